# DTR_HAS_PYTHON: the Python package is built. Read before the libraries, which are then position
# independent.
set(DTR_HAS_PYTHON OFF)
if(DTR_WITH_PYTHON)
  # A python of pyenv or conda may stand first on PATH, without numpy: the system's own is meant.
  if(NOT Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
    set(Python3_EXECUTABLE /usr/bin/python3)
  endif()
  find_package(Python3 3.9 QUIET COMPONENTS Interpreter Development.Module)
  if(Python3_FOUND)
    find_package(pybind11 2.10 QUIET CONFIG)
  endif()
  if(Python3_FOUND AND pybind11_FOUND)
    set(DTR_HAS_PYTHON ON)
  elseif(DTR_WITH_PYTHON STREQUAL AUTO)
    message(STATUS "dtr: pybind11 2.10 and Python's headers not found: python/ is left out (Debian: apt-get install pybind11-dev python3-dev)")
  else()
    message(FATAL_ERROR "DTR_WITH_PYTHON is ${DTR_WITH_PYTHON}: expected pybind11 2.10 and Python's headers, found none; install pybind11-dev and python3-dev or set DTR_WITH_PYTHON=AUTO")
  endif()
endif()
if(NOT DTR_HAS_PYTHON)
  # `--target dtr dtr_python` builds all that there is.
  add_custom_target(dtr_python COMMAND ${CMAKE_COMMAND} -E echo
    "dtr_python: left out, needs pybind11 and Python's headers: apt-get install pybind11-dev python3-dev, then configure with -DDTR_WITH_PYTHON=AUTO"
    VERBATIM)
endif()
