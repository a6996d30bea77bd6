# Writes OUTPUT, a file for CTest with one entry per suite of PROGRAM, a GoogleTest program:
# cmake -DPROGRAM=... -DNAME=... -DOUTPUT=... -DFOLDER=... -DTIMEOUT=s -DLABELS=... -P this.
# A process per suite and not per test: programs with the image library's 260 shared libraries take 0.4 s to start.
execute_process(COMMAND "${PROGRAM}" --gtest_list_tests WORKING_DIRECTORY "${FOLDER}"
  OUTPUT_VARIABLE listing RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "${PROGRAM} --gtest_list_tests: ended with ${failed}:\n${listing}")
endif()
string(REGEX MATCHALL "[^\n]+" lines "${listing}")
set(body "")
foreach(line IN LISTS lines)
  # "Suite.", or with a type or parameters "Prefix/Suite/0.  # TypeParam = int"; tests are indented.
  if(NOT line MATCHES "^([^ ]+)\\.( *#.*)?$")
    continue()
  endif()
  set(suite "${CMAKE_MATCH_1}")
  set(entry "${NAME}/${suite}")
  string(APPEND body "add_test([=[${entry}]=] [=[${PROGRAM}]=] [=[--gtest_filter=${suite}.*]=])\n"
    "set_tests_properties([=[${entry}]=] PROPERTIES WORKING_DIRECTORY [=[${FOLDER}]=] SKIP_RETURN_CODE 77 "
    "TIMEOUT ${TIMEOUT} LABELS \"${LABELS}\")\n")
endforeach()
if(NOT body)
  message(FATAL_ERROR "${PROGRAM}: expected tests, found none")
endif()
file(WRITE "${OUTPUT}" "${body}")
