# cmake -D BUILD=... -D SOURCE=... -D WORK=... -D DTR=... -P find_package_test.cmake
# Installs the build into an empty prefix and makes a program of five lines against nothing but that prefix;
# it lists the views of a set that the installed `dtr` wrote. The man page and the completion are there too.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "${ARGN}: exit code ${code}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
set(prefix ${WORK}/prefix)
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix})
foreach(file bin/dtr share/man/man1/dtr.1.gz share/bash-completion/completions/dtr)
  if(NOT EXISTS ${prefix}/${file})
    message(FATAL_ERROR "${file}: expected it to be installed, found nothing")
  endif()
endforeach()

run(${CMAKE_COMMAND} -S ${SOURCE}/user -B ${WORK}/user -G Ninja -D CMAKE_PREFIX_PATH=${prefix}
  -D CMAKE_FIND_USE_PACKAGE_REGISTRY=OFF)
run(${CMAKE_COMMAND} --build ${WORK}/user)

run(${prefix}/bin/dtr dataset make plane -o ${WORK}/plane --views 3 --width 64 --height 48)
run(${prefix}/bin/dtr import --cameras ${WORK}/plane/cameras.json --images ${WORK}/plane/images
  --depth ${WORK}/plane/depth -o ${WORK}/plane.dtr)
run(${WORK}/user/views ${WORK}/plane.dtr)
if(NOT output STREQUAL "0000.jpg\n0001.jpg\n0002.jpg\n")
  message(FATAL_ERROR "views: expected three photos, found\n${output}")
endif()
file(REMOVE_RECURSE ${WORK})
