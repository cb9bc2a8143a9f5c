# Writes LIST, a file by which ctest runs each suite of PROGRAM as one test, called LABEL.suite, in ENVIRONMENT.
execute_process(COMMAND ${PROGRAM} --gtest_list_tests OUTPUT_VARIABLE names ERROR_VARIABLE errors RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "${PROGRAM} does not list its tests: ${errors}")
endif()
string(REGEX MATCHALL "(^|\n)[^ \n]+\\." suites "${names}")
set(lines "")
foreach(suite IN LISTS suites)
  string(REGEX REPLACE "[\n.]" "" suite "${suite}")
  string(APPEND lines "add_test([[${LABEL}.${suite}]] [[${PROGRAM}]] [[--gtest_filter=${suite}.*]])\n"
         "set_tests_properties([[${LABEL}.${suite}]] PROPERTIES TIMEOUT 600 COST 20 LABELS ${LABEL} ENVIRONMENT [[${ENVIRONMENT}]])\n")
endforeach()
file(WRITE ${LIST} "${lines}")
