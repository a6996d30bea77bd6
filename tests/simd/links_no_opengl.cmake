# cmake -D PROGRAM=... -P links_no_opengl.cmake
# Fails when the program needs a library of OpenGL, EGL, GLX or epoxy, or a library of ours or of its own choice does.
execute_process(COMMAND ldd ${PROGRAM} RESULT_VARIABLE code OUTPUT_VARIABLE libraries)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "ldd ${PROGRAM}: exit code ${code}")
endif()
string(REGEX MATCHALL "lib(GL|GLX|EGL|OpenGL|GLdispatch|GLESv2|epoxy|glfw)\\.so[^ ]*" found "${libraries}")
if(found)
  message(FATAL_ERROR "${PROGRAM}: expected no OpenGL library, found ${found}\n${libraries}")
endif()
execute_process(COMMAND ${PROGRAM} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "${PROGRAM}: exit code ${code}\n${output}")
endif()
