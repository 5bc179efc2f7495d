# Lint and coverage, never part of the default build:
#
#   relign_tidy            clang-tidy (.clang-tidy) on every source; relign_tidy_changed: on those that differ from main
#   relign_coverage        line coverage of core/ by the tests that ran before, by gcovr (preset coverage)
set(tidy "${PROJECT_SOURCE_DIR}/.ci/tidy" -p "${CMAKE_BINARY_DIR}")
add_custom_target(relign_tidy COMMAND ${tidy} USES_TERMINAL VERBATIM)
add_custom_target(relign_tidy_changed COMMAND ${tidy} --changed USES_TERMINAL VERBATIM)

if(RELIGN_COVERAGE)
  set(RELIGN_COVERAGE_FILTER "core/" CACHE STRING "Sources that relign_coverage counts: a regular expression from the tree's root")
  add_custom_target(relign_coverage
    COMMAND sh -c "gcovr --root . --filter '${RELIGN_COVERAGE_FILTER}' --print-summary --txt '${CMAKE_BINARY_DIR}/coverage.txt' '${CMAKE_BINARY_DIR}' | grep ^lines:"
    WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}" USES_TERMINAL VERBATIM)
endif()
