# Headers that most sources include are parsed once for the product and once for the tests: beside the unity build they were a
# fifth of a compile job. Off with DTR_UNITY, so that each file is also compiled with its own includes alone.
# dtr_precompiled(KIND HEADERS...): the headers of a kind; then dtr_use_precompiled(TARGET KIND) for each target that is compiled alike.
# The compiler ignores a header whose options differ and says so (-Winvalid-pch).
set(DTR_PRECOMPILED
  <algorithm> <array> <atomic> <chrono> <cmath> <cstdint> <cstdlib> <cstring> <filesystem> <fstream> <functional> <limits> <map>
  <memory> <mutex> <numbers> <numeric> <optional> <set> <span> <sstream> <stdexcept> <string> <string_view> <thread>
  <utility> <variant> <vector>
  <Eigen/Dense> <fmt/format.h> <fmt/ranges.h> <nlohmann/json.hpp>)

function(dtr_precompiled kind)
  if(NOT DTR_UNITY OR DTR_SANITIZE)
    return()
  endif()
  file(CONFIGURE OUTPUT precompiled_${kind}.cpp CONTENT "// The headers are what counts.\n")
  add_library(dtr_precompiled_${kind} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/precompiled_${kind}.cpp)
  target_link_libraries(dtr_precompiled_${kind} PRIVATE Eigen3::Eigen fmt::fmt nlohmann_json::nlohmann_json)
  target_compile_features(dtr_precompiled_${kind} PRIVATE cxx_std_20)
  if(kind STREQUAL tests)
    target_link_libraries(dtr_precompiled_${kind} PRIVATE GTest::gtest GTest::gmock)
    dtr_test_options(dtr_precompiled_${kind})
  else()
    dtr_compile_options(dtr_precompiled_${kind})
    dtr_position_independent(dtr_precompiled_${kind})
  endif()
  target_precompile_headers(dtr_precompiled_${kind} PRIVATE ${ARGN})
endfunction()

function(dtr_use_precompiled target kind)
  if(DTR_UNITY AND NOT DTR_SANITIZE)
    target_precompile_headers(${target} REUSE_FROM dtr_precompiled_${kind})
    target_compile_definitions(${target} PRIVATE $<TARGET_PROPERTY:fmt::fmt,INTERFACE_COMPILE_DEFINITIONS>)
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
      # Of GCC 12's false alarms in std::string those whose header counts no longer as the system's.
      target_compile_options(${target} PRIVATE -Wno-stringop-overflow -Wno-stringop-overread -Wno-array-bounds)
    endif()
    if(DTR_CCACHE AND CMAKE_CXX_COMPILER_ID STREQUAL GNU)
      target_compile_options(${target} PRIVATE -fpch-preprocess)  # lets ccache see which header is meant
    endif()
  endif()
endfunction()
