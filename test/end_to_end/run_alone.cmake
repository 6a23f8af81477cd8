# Read by ctest. A pseudo-terminal that is unplugged gives its number away while the program still holds the lock of that
# name: whoever gets the number would be refused.
foreach(test IN LISTS kphi_end_to_end_test_TESTS)
  if(test MATCHES "WaysOut.*/Unplugged")
    set_tests_properties("${test}" PROPERTIES RUN_SERIAL TRUE)
  endif()
endforeach()
