# Builds the library and odd_inputs.cpp as a stranger with these flags would, and runs it.
# cmake -DSOURCE=… -DWORK=… -DCXX=… -DFLOAT=ON|OFF -DFLAGS=… -P odd_inputs.cmake
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "${ARGN}: ${code}\n${out}")
  endif()
  set(output "${out}" PARENT_SCOPE)
endfunction()

find_program(found ${CXX})
if(NOT found)
  message("SKIPPED: no ${CXX} here")
  return()
endif()
run(${CMAKE_COMMAND} -S ${SOURCE}/compensation -B ${WORK} -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_BUILD_TYPE=None
    -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER} "-DCMAKE_CXX_FLAGS=${FLAGS}" -DKPHI_COMPENSATION_FLOAT=${FLOAT})
run(${CMAKE_COMMAND} --build ${WORK} --parallel 1)
set(number)
if(FLOAT)
  set(number -DKPHI_FLOAT)
endif()
separate_arguments(flags UNIX_COMMAND "${FLAGS}")
run(${CXX} ${flags} ${number} -std=c++17 -I${WORK}/include ${SOURCE}/test/compensation/odd_inputs.cpp
    ${WORK}/libkphi_compensation.a -o ${WORK}/odd_inputs -lm)
run(${WORK}/odd_inputs)
message("${output}")
if(NOT output MATCHES "^36[0-9][0-9][0-9][0-9][0-9] results, 0 bad")
  message(FATAL_ERROR "unexpected: ${output}")
endif()
# Who compiles the sources so by himself is told, and his own code that includes the headers is not.
if(FLAGS MATCHES "fast")
  execute_process(COMMAND ${CXX} ${flags} -std=c++17 -I${SOURCE} -fsyntax-only ${SOURCE}/compensation/mixing.cpp
                  RESULT_VARIABLE code ERROR_VARIABLE out)
  if(code EQUAL 0 OR NOT out MATCHES "without -ffast-math")
    message(FATAL_ERROR "the sources compile with -ffast-math: ${out}")
  endif()
endif()
