# relign_add_test(NAME source... [LIBRARIES target...] [LABELS label...] [TIMEOUT seconds])
#
# One line registers one GoogleTest program. NAME mirrors the place in the tree
# (base_hash, optics_golden_rays, plugins_rho ...). Tests find files through these macros:
#   RELIGN_TEST_DATA    tests/golden
#   RELIGN_SOURCE_DIR   the source tree        RELIGN_PROGRAM   the relign-bench binary
#   RELIGN_PLUGIN_DIR   the folder of built plugins
#
# relign_add_python_file_test(NAME test_file.py): a unittest program for the distribution's own Python, where its packages
# (python3-scipy ...) are; python3 of the PATH may be another one. What it lacks is skipped with a word.
include(GoogleTest)

find_program(RELIGN_DISTRIBUTION_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH)
if(NOT RELIGN_DISTRIBUTION_PYTHON)
  find_program(RELIGN_DISTRIBUTION_PYTHON python3)
endif()

function(relign_add_python_file_test name file)
  if(NOT RELIGN_DISTRIBUTION_PYTHON)
    message(STATUS "no python3: test ${name} is left out")
    return()
  endif()
  add_test(NAME ${name} COMMAND "${RELIGN_DISTRIBUTION_PYTHON}" -B -m unittest discover -v -p "${file}"
           WORKING_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}")
  set_tests_properties(${name} PROPERTIES TIMEOUT 300
    ENVIRONMENT "RELIGN_BENCH=${CMAKE_BINARY_DIR}/bin/relign-bench;XDG_CACHE_HOME=${CMAKE_BINARY_DIR}/test-cache")
endfunction()

function(relign_add_test name)
  cmake_parse_arguments(TEST "" "TIMEOUT" "LIBRARIES;LABELS;DEPENDS" ${ARGN})
  if(NOT TEST_TIMEOUT)
    set(TEST_TIMEOUT 120)
  endif()
  add_executable(test_${name} ${TEST_UNPARSED_ARGUMENTS})
  target_link_libraries(test_${name} PRIVATE relign_compile ${TEST_LIBRARIES} GTest::gmock GTest::gtest_main)
  target_include_directories(test_${name} PRIVATE "${PROJECT_SOURCE_DIR}/core" "${PROJECT_SOURCE_DIR}/tests")
  foreach(wing ${RELIGN_WINGS})
    target_include_directories(test_${name} PRIVATE "${PROJECT_SOURCE_DIR}/core/${wing}" "${PROJECT_SOURCE_DIR}/tests/${wing}")
  endforeach()
  target_compile_definitions(test_${name} PRIVATE
    RELIGN_TEST_DATA="${PROJECT_SOURCE_DIR}/tests/golden"
    RELIGN_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
    RELIGN_PROGRAM="${CMAKE_BINARY_DIR}/bin/relign-bench"
    RELIGN_PLUGIN_DIR="${RELIGN_PLUGIN_OUTPUT_DIRECTORY}")
  if(TEST_DEPENDS)
    add_dependencies(test_${name} ${TEST_DEPENDS})
  endif()
  set_target_properties(test_${name} PROPERTIES CXX_STANDARD 20 RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/tests")
  add_test(NAME ${name} COMMAND test_${name} --gtest_brief=1)
  set_tests_properties(${name} PROPERTIES TIMEOUT ${TEST_TIMEOUT} LABELS "${TEST_LABELS}"
    ENVIRONMENT "XDG_CACHE_HOME=${CMAKE_BINARY_DIR}/test-cache")
endfunction()
