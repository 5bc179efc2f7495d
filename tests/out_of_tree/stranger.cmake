# What the scripts here share. The installed program comes first in PATH, as for a user.
set(PREFIX "${PLACE}/moved")
set(ENV{PATH} "${PREFIX}/bin:$ENV{PATH}")

# Where to find the package, and what this build itself was configured with.
set(CONFIGURE -G "${GENERATOR}" "-DCMAKE_PREFIX_PATH=${PREFIX}" "-DCMAKE_CXX_COMPILER=${COMPILER}"
    "-DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}")

# Runs a command in a folder; its output lands in `said` and is shown when it fails.
macro(run folder)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY "${folder}"
                  OUTPUT_VARIABLE said ERROR_VARIABLE said RESULT_VARIABLE failed)
  if(failed)
    string(JOIN " " command ${ARGN})
    message(FATAL_ERROR "${command}\nexit code ${failed}\n${said}")
  endif()
endmacro()

# Configures, builds and tests the project in `folder` below build/.
macro(build_and_test folder)
  run("${folder}" "${CMAKE_COMMAND}" -S . -B build ${CONFIGURE} -Werror=dev)
  run("${folder}" "${CMAKE_COMMAND}" --build build)
  run("${folder}" "${CMAKE_CTEST_COMMAND}" --test-dir build --output-on-failure --no-tests=error)
endmacro()
