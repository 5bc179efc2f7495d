# What my_plugin promises, checked by running trials. relign_test_plugin gives trial, value_at, step_count, fail
# and PLUGIN_FOLDER, the built plugin.

set(setting "${PLUGIN_FOLDER}" --noise-level rho0 --instance 1 --steps 40)

# It is shown images alone, and what it would glue is where it is.
trial(seen ${setting})
value_at(source "${seen}" last recommendation)
if(NOT source STREQUAL "current")
  fail("the recommendation is '${source}', expected the current pose")
endif()

# It gets nearer: the best of the visited poses is better than the start. (Sharpness alone finds no picture that
# is sharp in the wrong place; a trained policy should end at its best pose.)
value_at(before "${seen}" 0 commanded_mse)
set(best "${before}")
step_count(count "${seen}")
math(EXPR last "${count} - 1")
foreach(step RANGE ${last})
  value_at(here "${seen}" ${step} commanded_mse)
  if(here LESS best)
    set(best "${here}")
  endif()
endforeach()
if(NOT best LESS before)
  fail("no step was better than the start, whose noise-free MSE is ${before}")
endif()

# Same seed, same trial.
trial(again ${setting})
if(NOT again STREQUAL seen)
  fail("two runs of one trial differ; is all randomness drawn from trial.seed()?")
endif()
