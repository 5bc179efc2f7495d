# Shared by the scripts here. The installed program comes first in PATH, as for a user.
set(PREFIX "${PLACE}/moved")
set(ENV{PATH} "${PREFIX}/bin:$ENV{PATH}")

# Arguments that find the package, and the settings of this build.
set(CONFIGURE -G "${GENERATOR}" "-DCMAKE_PREFIX_PATH=${PREFIX}" "-DCMAKE_CXX_COMPILER=${COMPILER}"
    "-DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}")

# Runs a command in a folder; its output goes to `said` and is shown if it fails.
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

# Runs three steps with the plugin of kind KIND at `plugin`, from the folder `work`.
macro(try_plugin)
  if(KIND STREQUAL "scene")
    run("${work}" relign-bench try random --scene ${plugin} --noise-level rho0 --steps 3)
  elseif(KIND STREQUAL "noise-level")
    run("${work}" relign-bench try random --noise-level ${plugin} --steps 3)
  else()
    run("${work}" relign-bench try ${plugin} --steps 3)
  endif()
  if(NOT said MATCHES "\n +3 ")
    message(FATAL_ERROR "expected three steps:\n${said}")
  endif()
endmacro()
