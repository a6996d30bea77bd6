# cmake -D BUILD=... -D SOURCE=... -D WORK=... -D DTR=... -P find_package_test.cmake
# Installs the build into an empty prefix and builds examples/ against nothing but that prefix;
# they use a set that the installed `dtr` wrote. The man page and the completion are there too.
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

# Headers that call themselves internal stay at home, and no public one includes such a header.
file(GLOB_RECURSE internal ${prefix}/include/*/pipeline/*/*/*)
if(internal)
  message(FATAL_ERROR "expected no internal header to be installed, found ${internal}")
endif()

run(${CMAKE_COMMAND} -S ${EXAMPLES} -B ${WORK}/examples -G Ninja -D CMAKE_PREFIX_PATH=${prefix}
  -D CMAKE_FIND_USE_PACKAGE_REGISTRY=OFF)
run(${CMAKE_COMMAND} --build ${WORK}/examples)

# The program finds its module from a link on the PATH, too.
file(CREATE_LINK ${prefix}/bin/dtr ${WORK}/dtr SYMBOLIC)
run(${WORK}/dtr dataset make plane -o ${WORK}/plane --views 3 --width 64 --height 48)
run(${WORK}/dtr import --cameras ${WORK}/plane/cameras.json --images ${WORK}/plane/images
  --depth ${WORK}/plane/depth -o ${WORK}/plane.dtr)
run(${WORK}/examples/render_path ${WORK}/plane.dtr ${WORK}/path)
if(NOT EXISTS ${WORK}/path/000011.png OR NOT output MATCHES "000011.png: [0-9.]+ % seen")
  message(FATAL_ERROR "render_path: expected 12 images, found\n${output}")
endif()
run(${WORK}/examples/point_cloud ${WORK}/plane.dtr 0001 ${WORK}/cloud.ply)
if(NOT output MATCHES "cloud.ply: 3[0-9][0-9][0-9] points")
  message(FATAL_ERROR "point_cloud: expected a point for every pixel of 64 x 48, found\n${output}")
endif()
if(PYTHON)
  # Lines, as a semicolon would make two arguments of it.
  run(${CMAKE_COMMAND} -E env PYTHONPATH=${prefix}/${PYTHON_DIR} PYTHONDONTWRITEBYTECODE=1 ${PYTHON} -c
    "import dtr, sys\ns = dtr.load(sys.argv[1])\nprint(dtr.__file__, s.views[0].depth.shape)" ${WORK}/plane.dtr)
  if(NOT output MATCHES "${prefix}/${PYTHON_DIR}/dtr/__init__.py .48, 64.")
    message(FATAL_ERROR "python: expected the installed package and depth of 48 x 64, found\n${output}")
  endif()
endif()
# Without its module the program describes sets, and one line says why it writes no JPEG.
file(GLOB_RECURSE module ${prefix}/lib*/dtr/dtr_images.so)
list(FILTER module EXCLUDE REGEX python)
file(REMOVE ${module})
run(${prefix}/bin/dtr info ${WORK}/plane.dtr)
execute_process(COMMAND ${prefix}/bin/dtr render ${WORK}/plane.dtr --like 0001 -o ${WORK}/x.jpg
  RESULT_VARIABLE code ERROR_VARIABLE output)
if(NOT code EQUAL 1 OR NOT output MATCHES "dtr: images cannot be read or written, as a library cannot be loaded: dtr_images.so: [^\n]*\n$")
  message(FATAL_ERROR "render: expected an error about dtr_images.so, found ${code}: ${output}")
endif()
# Photos to set needs COLMAP and minutes; here it must link, and say what it wants.
execute_process(COMMAND ${WORK}/examples/photos_to_set ${WORK}/nothing ${WORK}/x.dtr
  RESULT_VARIABLE code ERROR_VARIABLE output)
if(NOT code EQUAL 1 OR NOT output MATCHES "nothing: expected")
  message(FATAL_ERROR "photos_to_set: expected an error about its folder, found ${code}: ${output}")
endif()
file(REMOVE_RECURSE ${WORK})
