# dtr_may_include(FOLDER others...): stops where a file of pipeline/FOLDER includes a file of pipeline/ that lies neither
# there nor in one of the others. "build" is that folder without those below it (its public headers), "build/*" with them.
# dtr_pipeline_folder(NAME MAY_INCLUDE others... SOURCES ... [PUBLIC libs...] [PRIVATE libs...]): the target
# dtr_pipeline_NAME of pipeline/NAME/*, which links what it may include.
function(dtr_may_include folder)
  foreach(one ${folder} ${ARGN})
    if(one MATCHES "^(.*)/\\*$")
      list(APPEND allowed "${CMAKE_MATCH_1}/")
    else()
      list(APPEND allowed "${one}/[^/]+$")
    endif()
  endforeach()
  list(GET allowed 0 own)
  list(JOIN allowed "|" allowed)
  file(GLOB_RECURSE files RELATIVE ${PROJECT_SOURCE_DIR}/pipeline ${PROJECT_SOURCE_DIR}/pipeline/*.h ${PROJECT_SOURCE_DIR}/pipeline/*.cpp)
  list(FILTER files INCLUDE REGEX "^${own}")
  foreach(file IN LISTS files)
    file(STRINGS ${PROJECT_SOURCE_DIR}/pipeline/${file} lines REGEX "^#include [\"<]pipeline/")
    foreach(line IN LISTS lines)
      string(REGEX REPLACE "^#include [\"<]pipeline/([^\">]*).*" "\\1" included "${line}")
      if(NOT included MATCHES "^(${allowed})")
        list(JOIN ARGN " " others)
        message(FATAL_ERROR "pipeline/${file}: includes pipeline/${included}; files of ${folder} may include those of pipeline/: ${folder} ${others}")
      endif()
    endforeach()
  endforeach()
endfunction()

function(dtr_pipeline_folder name)
  cmake_parse_arguments(ARG "" "" "MAY_INCLUDE;SOURCES;PUBLIC;PRIVATE" ${ARGN})
  if(ARG_MAY_INCLUDE)  # core has a line for each of its folders
    dtr_may_include(${name}/* ${ARG_MAY_INCLUDE})
    list(TRANSFORM ARG_MAY_INCLUDE REPLACE "/\\*$" "" OUTPUT_VARIABLE below)
    list(TRANSFORM below PREPEND dtr_pipeline_)
  endif()
  dtr_library(dtr_pipeline_${name} SOURCES ${ARG_SOURCES} PUBLIC ${below} ${ARG_PUBLIC}
    PRIVATE ${ARG_PRIVATE} fmt::fmt nlohmann_json::nlohmann_json)
  target_compile_definitions(dtr_pipeline_${name} PRIVATE DTR_VERSION="${PROJECT_VERSION}")
endfunction()
