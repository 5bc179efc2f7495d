# Runs the SCRIPT of relign_test_plugin: cmake -DRELIGN_BENCH=... -DPLUGIN_FOLDER=... -DSCRIPT=... -P RelignTrials.cmake
#
# What a script may use besides CMake's own commands; CMake compares numbers by LESS, GREATER and EQUAL:
#   trial(RESULT ALGORITHM option...)         one trial, `relign-bench try ALGORITHM option... --json`
#   value_at(RESULT TRIAL STEP key...)        one value of a step of it; STEP counts from 0, last is the last one
#   step_count(RESULT TRIAL)                  steps of it, step 0 included
#   fail(TEXT...)                             ends the test
cmake_minimum_required(VERSION 3.25)

function(fail)
  string(JOIN "" text ${ARGN})
  message(FATAL_ERROR "${text}")
endfunction()

function(trial result)
  execute_process(COMMAND "${RELIGN_BENCH}" try ${ARGN} --json
                  OUTPUT_VARIABLE out ERROR_VARIABLE said RESULT_VARIABLE failed)
  if(failed)
    string(JOIN " " arguments ${ARGN})
    fail("relign-bench try ${arguments}: exit code ${failed}\n${said}")
  endif()
  set(${result} "${out}" PARENT_SCOPE)
endfunction()

function(step_count result trial)
  string(JSON count LENGTH "${trial}" steps)
  set(${result} ${count} PARENT_SCOPE)
endfunction()

function(value_at result trial step)
  if(step STREQUAL "last")
    step_count(count "${trial}")
    math(EXPR step "${count} - 1")
  endif()
  string(JSON value GET "${trial}" steps ${step} ${ARGN})
  set(${result} "${value}" PARENT_SCOPE)
endfunction()

include("${SCRIPT}")
