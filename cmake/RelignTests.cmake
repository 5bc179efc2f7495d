# relign_add_test(NAME source... [LIBRARIES target...] [LABELS label...] [DEPENDS target...] [PROGRAM program])
#
# One line registers one test for CTest. NAME mirrors the place in the tree (base_hash, optics_golden_rays, plugins_rho ...).
# All tests of a folder are one GoogleTest program, test_FOLDER (test_harness_trials; test_plugins for all plugins), which
# is called with the source files whose tests shall run; PROGRAM names
# another one, for tests that link what others must not. Tests find files through these macros:
#   RELIGN_TEST_DATA    tests/golden
#   RELIGN_SOURCE_DIR   the source tree        RELIGN_PROGRAM   the relign-bench binary
#   RELIGN_PLUGIN_DIR   the folder of built plugins
#
# relign_add_python_file_test(NAME test_file.py): a unittest program for the distribution's own Python, where its packages
# (python3-scipy ...) are. What it lacks is skipped with a message.
include(GoogleTest)

function(relign_add_python_file_test name file)
  add_test(NAME ${name} COMMAND "${RELIGN_DISTRIBUTION_PYTHON}" -B -m unittest discover -v -p "${file}"
           WORKING_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}")
  set_tests_properties(${name} PROPERTIES
    ENVIRONMENT "RELIGN_BENCH=${CMAKE_BINARY_DIR}/bin/relign-bench;XDG_CACHE_HOME=${CMAKE_BINARY_DIR}/test-cache")
endfunction()

add_library(relign_test_main STATIC "${PROJECT_SOURCE_DIR}/tests/main.cpp" "${PROJECT_SOURCE_DIR}/tests/run_tests.cpp")
set_target_properties(relign_test_main PROPERTIES UNITY_BUILD OFF)  # a program may bring a main function of its own
target_link_libraries(relign_test_main PUBLIC relign_compile GTest::gmock GTest::gtest)

function(relign_add_test name)
  cmake_parse_arguments(TEST "" "PROGRAM" "LIBRARIES;LABELS;DEPENDS" ${ARGN})
  file(RELATIVE_PATH folder "${PROJECT_SOURCE_DIR}" "${CMAKE_CURRENT_SOURCE_DIR}")
  if(TEST_PROGRAM)
    set(program ${TEST_PROGRAM})
  elseif(folder MATCHES "^plugins/")
    set(program test_plugins)
  else()
    string(REPLACE "/" "_" program "${folder}")
    string(REGEX REPLACE "^tests_" "test_" program "${program}")
  endif()
  if(NOT TARGET ${program})
    relign_add_test_program(${program})
  endif()
  set(files "")
  foreach(source ${TEST_UNPARSED_ARGUMENTS})
    get_filename_component(source "${source}" ABSOLUTE)
    get_target_property(sources ${program} SOURCES)
    if(NOT source IN_LIST sources)
      target_sources(${program} PRIVATE "${source}")
    endif()
    if(source MATCHES "_test.cpp$")
      file(RELATIVE_PATH file "${PROJECT_SOURCE_DIR}" "${source}")
      list(APPEND files "${file}")
    endif()
  endforeach()
  target_link_libraries(${program} PRIVATE ${TEST_LIBRARIES})
  if(TEST_DEPENDS)
    add_dependencies(${program} ${TEST_DEPENDS})
  endif()
  add_test(NAME ${name} COMMAND ${program} --gtest_brief=1 ${files})
  set_tests_properties(${name} PROPERTIES LABELS "${TEST_LABELS}"
    ENVIRONMENT "XDG_CACHE_HOME=${CMAKE_BINARY_DIR}/test-cache")
endfunction()

function(relign_add_test_program program)
  add_executable(${program} "${PROJECT_SOURCE_DIR}/tests/error_text.h")
  target_link_libraries(${program} PRIVATE relign_test_main)
  target_compile_options(${program} PRIVATE $<$<CONFIG:Release>:-O0>)
  target_include_directories(${program} PRIVATE "${PROJECT_SOURCE_DIR}/core" "${PROJECT_SOURCE_DIR}/tests")
  foreach(wing ${RELIGN_WINGS})
    target_include_directories(${program} PRIVATE "${PROJECT_SOURCE_DIR}/core/${wing}" "${PROJECT_SOURCE_DIR}/tests/${wing}")
  endforeach()
  target_compile_definitions(${program} PRIVATE
    RELIGN_TEST_DATA="${PROJECT_SOURCE_DIR}/tests/golden"
    RELIGN_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
    RELIGN_PROGRAM="${CMAKE_BINARY_DIR}/bin/relign-bench"
    RELIGN_PLUGIN_DIR="${RELIGN_PLUGIN_OUTPUT_DIRECTORY}")
  set_target_properties(${program} PROPERTIES CXX_STANDARD 20 RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/tests")
endfunction()
