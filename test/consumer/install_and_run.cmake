# Installs the library into a fresh prefix, either from an existing build (BUILT) or from the folder itself (SOURCE, as the
# root of its own project), then configures, builds and runs the project CONSUMER against it below WORK.
cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${ARGV}\nended with ${result}:\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
set(prefix ${WORK}/prefix)
set(common -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_CXX_FLAGS=${CXX_FLAGS}
           -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER})
set(speeds "10232.6\n10232.6\n9843.1\n10232.6\n")
if(DEFINED BUILT)
  set(with_file ON)
  set(from ${BUILT})
else()
  set(with_file OFF)
  set(from ${WORK}/library)
  run(${CMAKE_COMMAND} -S ${SOURCE} -B ${from} ${common} -DKPHI_COMPENSATION_FILE=OFF)
  run(${CMAKE_COMMAND} --build ${from} --parallel 1)
endif()
run(${CMAKE_COMMAND} --install ${from} --component compensation --prefix ${prefix})

# The example of the library's README and the lines that link it, as they stand there.
function(readme_block language into)
  file(READ ${README} readme)
  string(FIND "${readme}" "```${language}\n" begin)
  if(begin EQUAL -1)
    message(FATAL_ERROR "${README} has no block of ${language}")
  endif()
  string(LENGTH "```${language}\n" fence)
  math(EXPR begin "${begin} + ${fence}")
  string(SUBSTRING "${readme}" ${begin} -1 block)
  string(FIND "${block}" "```" end)
  string(SUBSTRING "${block}" 0 ${end} block)
  set(${into} "${block}" PARENT_SCOPE)
endfunction()
readme_block(cpp example)
readme_block(cmake linking)
file(WRITE ${WORK}/readme/example.cpp "${example}")
file(WRITE ${WORK}/readme/CMakeLists.txt
  "cmake_minimum_required(VERSION 3.22)\nproject(readme LANGUAGES CXX)\nadd_library(my_controller STATIC example.cpp)\n"
  "target_compile_options(my_controller PRIVATE -Wall -Wextra -Werror -fno-exceptions -fno-rtti)\n${linking}")
run(${CMAKE_COMMAND} -S ${WORK}/readme -B ${WORK}/readme/build ${common} -DCMAKE_PREFIX_PATH=${prefix})
run(${CMAKE_COMMAND} --build ${WORK}/readme/build --parallel 1)

run(${CMAKE_COMMAND} -S ${CONSUMER} -B ${WORK}/stranger ${common} -DCMAKE_PREFIX_PATH=${prefix} -DWITH_FILE=${with_file})
run(${CMAKE_COMMAND} --build ${WORK}/stranger --parallel 1)

# sqrt(1.5 N / (1.7e-8 N/RPM² k_i)) with k_i = .84269, .84269, .91071, .84269.
run(${WORK}/stranger/fly)
if(NOT output STREQUAL speeds)
  message(FATAL_ERROR "unexpected speeds:\n${output}")
endif()

# The same in C, linked by a C compiler.
run(${CMAKE_COMMAND} -S ${CONSUMER}/plain_c -B ${WORK}/plain_c -G ${GENERATOR} -DCMAKE_C_COMPILER=${CC}
    -DCMAKE_C_FLAGS=${C_FLAGS} -DCMAKE_PREFIX_PATH=${prefix})
run(${CMAKE_COMMAND} --build ${WORK}/plain_c --parallel 1)
run(${WORK}/plain_c/fly_c)
if(NOT output STREQUAL "${speeds}6.0000\n")
  message(FATAL_ERROR "unexpected speeds or thrusts in C:\n${output}")
endif()
if(with_file)
  run(${WORK}/stranger/read_coefficients ${CONSUMER}/coefficients.yaml)
  if(NOT output STREQUAL "1.7e-08\n")
    message(FATAL_ERROR "unexpected K_T: ${output}")
  endif()
endif()
