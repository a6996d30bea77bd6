# dtr_library(NAME SOURCES ... [APART ...] [PUBLIC libs...] [PRIVATE libs...]): one static library per folder. With
# DTR_UNITY its sources are compiled several at a time; those of APART each alone.
# dtr_test(NAME SOURCES ... [APART ...] LIBS ... [LABELS ...] [TIMEOUT s]): one GoogleTest program, discovered by CTest.
# dtr_one_entry_test(the same): one entry of CTest for all its tests, which share what is slow to start. It fails when
# one of them does, and is skipped when one of them was and none failed.

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
    if(NOT DTR_SANITIZE AND CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION MATCHES "^12\\.")
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
  install(TARGETS ${name} EXPORT dtrTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
endfunction()

function(dtr_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;APART;LIBS;LABELS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES} ${ARG_APART})
  dtr_unity(${name} ${ARG_APART})
  target_link_libraries(${name} PRIVATE ${ARG_LIBS} GTest::gtest GTest::gmock GTest::gtest_main)
  dtr_test_options(${name})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  # The default of DTR_DATA lies beside the checkout; tests say SKIPPED where it is absent.
  set(properties TIMEOUT ${ARG_TIMEOUT})
  gtest_discover_tests(${name} TEST_PREFIX "${name}/" DISCOVERY_TIMEOUT 60
    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} PROPERTIES ${properties})
  if(ARG_LABELS)
    # gtest_discover_tests takes a list of labels apart; CTest reads them from a file of our own.
    set(file ${CMAKE_CURRENT_BINARY_DIR}/${name}_labels.cmake)
    file(WRITE ${file} "if(${name}_TESTS)
  set_tests_properties(\${${name}_TESTS} PROPERTIES LABELS \"${ARG_LABELS}\")
endif()
")
    set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${file})
  endif()
endfunction()

function(dtr_one_entry_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;APART;LIBS;LABELS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES} ${ARG_APART})
  dtr_unity(${name} ${ARG_APART})
  target_link_libraries(${name} PRIVATE ${ARG_LIBS} dtr_one_entry_main GTest::gtest GTest::gmock)
  dtr_test_options(${name})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  add_test(NAME ${name} COMMAND ${name} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  # 77: kSkippedExitCode of tests/support/one_entry_main.h.
  set_tests_properties(${name} PROPERTIES LABELS "${ARG_LABELS}" TIMEOUT ${ARG_TIMEOUT} SKIP_RETURN_CODE 77)
endfunction()
