# dtr_library(NAME SOURCES ... [APART ...] [PUBLIC libs...] [PRIVATE libs...]): one static library per folder. With
# DTR_UNITY its sources are compiled several at a time; those of APART each alone.
# dtr_test(NAME SOURCES ... [APART ...] LIBS ... [LABELS ...] [TIMEOUT s]): one GoogleTest program, an entry of CTest for
# each of its suites (cmake/DiscoverSuites.cmake). An entry fails when one of its tests does, and is skipped when one of
# them was and none failed.
# dtr_one_entry_test(the same): one entry of CTest for all its suites, which share what is slow to start.

function(dtr_compile_options target)
  # Bits must match between machines and thread counts: no contraction into FMA, no fast maths.
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wpedantic -ffp-contract=off)
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    # GCC 12 sees overlapping copies in std::string's operator+ where there are none (GCC bug 105651).
    target_compile_options(${target} PRIVATE -Wno-restrict)
  endif()
  set(strict ${DTR_WARNINGS_AS_ERRORS})
  if(strict STREQUAL AUTO)
    set(strict OFF)  # sanitized code makes GCC warn of what is not there
    if(NOT DTR_SANITIZE AND CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION MATCHES "^1[24]\\.")
      set(strict ON)
    endif()
  endif()
  if(strict)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(DTR_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${DTR_SANITIZE} -fno-omit-frame-pointer)
    target_link_options(${target} PRIVATE -fsanitize=${DTR_SANITIZE})
    get_target_property(type ${target} TYPE)
    if(type STREQUAL EXECUTABLE)
      target_sources(${target} PRIVATE ${PROJECT_SOURCE_DIR}/tests/support/keep_libraries.cpp)
    endif()
  endif()
endfunction()

# The Python module is a shared library of all this. Nobody replaces our functions at load time, so calls
# within a file need not allow for it.
function(dtr_position_independent target)
  if(DTR_HAS_PYTHON AND NOT CMAKE_POSITION_INDEPENDENT_CODE)
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    target_compile_options(${target} PRIVATE -fno-semantic-interposition)
  endif()
endfunction()

# Most of a compile job is headers: Eigen, JSON, Ceres. Names in one batch must differ.
function(dtr_unity target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${DTR_UNITY} UNITY_BUILD_BATCH_SIZE 8)
  if(NOT ARGN)
    return()
  endif()
  set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# The product's options; optimised less where the product is: tests are compiled more often than they run.
function(dtr_test_options target)
  dtr_compile_options(${target})
  if(CMAKE_BUILD_TYPE STREQUAL Release)
    target_compile_options(${target} PRIVATE -O1)
  endif()
endfunction()

function(dtr_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;APART;PUBLIC;PRIVATE" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES} ${ARG_APART})
  dtr_unity(${name} ${ARG_APART})
  add_library(dtr::${name} ALIAS ${name})
  target_include_directories(${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${DTR_INSTALL_HEADERS}>)
  target_compile_features(${name} PUBLIC cxx_std_20)  # the headers need it, whoever includes them
  target_link_libraries(${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  dtr_compile_options(${name})
  dtr_position_independent(${name})
  dtr_use_precompiled(${name} product)
  install(TARGETS ${name} EXPORT dtrTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
endfunction()

# What takes long to load and few commands need is in modules, and a program loads them when it calls them. A program or library
# without dtr_on_demand links the same static libraries: so do all with sanitizers, whose dlopen knows no run path.
# dtr_module(NAME LIBRARY SOURCE): NAME.so of a static library of ours and all that it is made of.
function(dtr_module name library source)
  add_library(${name} MODULE ${source})
  set_target_properties(${name} PROPERTIES PREFIX "" CXX_VISIBILITY_PRESET hidden
    LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/modules)
  target_link_libraries(${name} PRIVATE ${library})
  target_link_options(${name} PRIVATE -Wl,--exclude-libs,ALL -Wl,--no-undefined -Wl,--as-needed)
  dtr_compile_options(${name})
  install(TARGETS ${name} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/dtr COMPONENT runtime)
endfunction()

# dtr_on_demand(TARGET FOLDER MODULE SOURCE): TARGET calls MODULE by SOURCE and does not link its library; where installed, it looks
# for it in FOLDER.
function(dtr_on_demand target folder module source)
  target_sources(${target} PRIVATE ${source})
  set_target_properties(${target} PROPERTIES DTR_ON_DEMAND ON
    BUILD_RPATH ${PROJECT_BINARY_DIR}/modules INSTALL_RPATH ${folder})
  add_dependencies(${target} ${module})
endfunction()

# Links in a fifth of the time; there are some ninety programs of tests.
find_program(DTR_GOLD ld.gold)

# Takes sources of tests off a list that include a folder of pipeline/ which is left out (DTR_WITH_...).
function(dtr_drop_left_out list)
  foreach(feature IN LISTS DTR_FEATURES)
    if(NOT DTR_WITH_${feature})
      string(TOLOWER ${feature} folder)
      foreach(source IN LISTS ${list})
        file(STRINGS ${source} includes REGEX "^#include \"pipeline/${folder}/")
        if(includes)
          list(REMOVE_ITEM ${list} ${source})
        endif()
      endforeach()
    endif()
  endforeach()
  set(${list} ${${list}} PARENT_SCOPE)
endfunction()

# Whether programs of these labels are built with all others.
function(dtr_is_built_with_all labels result)
  set(${result} TRUE PARENT_SCOPE)
  if(NOT DTR_SLOW_TESTS AND "slow" IN_LIST labels)
    set(${result} FALSE PARENT_SCOPE)
  endif()
endfunction()

# No program where none of its tests is left.
function(dtr_test_program name)
  cmake_parse_arguments(ARG "" "TIMEOUT;COST" "SOURCES;APART;LIBS;LABELS" ${ARGN})
  dtr_drop_left_out(ARG_SOURCES)
  dtr_drop_left_out(ARG_APART)
  if(NOT "${ARG_SOURCES};${ARG_APART}" MATCHES "_test\\.cpp")
    return()
  endif()
  add_executable(${name} ${ARG_SOURCES} ${ARG_APART})
  dtr_is_built_with_all("${ARG_LABELS}" with_all)
  if(NOT with_all)
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
  dtr_unity(${name} ${ARG_APART})
  target_link_libraries(${name} PRIVATE ${ARG_LIBS} dtr_test_main GTest::gtest GTest::gmock)
  dtr_test_options(${name})
  dtr_use_precompiled(${name} tests)
  if(DTR_GOLD AND NOT DTR_SANITIZE)
    target_link_options(${name} PRIVATE -fuse-ld=gold)
  endif()
endfunction()

function(dtr_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;APART;LIBS;LABELS" ${ARGN})
  dtr_test_program(${name} ${ARGN})
  if(NOT TARGET ${name})
    return()
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 900)
  endif()
  # The default of DTR_DATA lies beside the checkout; tests say SKIPPED where it is absent.
  set(entries ${CMAKE_CURRENT_BINARY_DIR}/${name}_suites.cmake)
  add_custom_command(TARGET ${name} POST_BUILD VERBATIM BYPRODUCTS ${entries}
    COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:${name}> -DNAME=${name} -DOUTPUT=${entries}
      -DFOLDER=${PROJECT_SOURCE_DIR} -DTIMEOUT=${ARG_TIMEOUT} "-DLABELS=${ARG_LABELS}"
      -P ${PROJECT_SOURCE_DIR}/cmake/DiscoverSuites.cmake)
  # A program that was not built, but was to be, is an entry that fails.
  set(file ${CMAKE_CURRENT_BINARY_DIR}/${name}_entries.cmake)
  dtr_is_built_with_all("${ARG_LABELS}" with_all)
  file(WRITE ${file} "if(EXISTS \"${entries}\")
  include(\"${entries}\")
elseif(${with_all})
  add_test(${name}_NOT_BUILT ${name}_NOT_BUILT)
endif()
")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${file})
endfunction()

# COST: seconds it takes, of tests that would otherwise be the last to end: CTest starts them first.
function(dtr_one_entry_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT;COST" "SOURCES;APART;LIBS;LABELS" ${ARGN})
  dtr_test_program(${name} ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  add_test(NAME ${name} COMMAND ${name} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  # 77: kSkippedExitCode of tests/support/test_main.h.
  set_tests_properties(${name} PROPERTIES LABELS "${ARG_LABELS}" TIMEOUT ${ARG_TIMEOUT} SKIP_RETURN_CODE 77)
  if(ARG_COST)
    set_tests_properties(${name} PROPERTIES COST ${ARG_COST})
  endif()
endfunction()
