# What my_plugin promises, checked by running trials. relign_test_plugin gives trial, value_at, step_count, fail
# and PLUGIN_FOLDER, the built plugin.

set(setting "${PLUGIN_FOLDER}" --noise-level rho0 --protocol blind --steps 30)

# It gets nearer: what it recommends at last is better than the start, on most instances. (Chance is in it, and its
# seeds change with its name: a promise for every single instance would not hold.)
set(better 0)
foreach(instance 0 1 2 3)
  trial(found ${setting} --instance ${instance})
  value_at(before "${found}" 0 recommended_mse)
  value_at(after "${found}" last recommended_mse)
  if(after LESS before)
    math(EXPR better "${better} + 1")
  endif()
endforeach()
if(better LESS 2)
  fail("it got nearer on ${better} of 4 instances")
endif()

# Same seed, same trial.
trial(again ${setting} --instance 3)
if(NOT again STREQUAL found)
  fail("two runs of one trial differ; is all randomness drawn from trial.seed()?")
endif()
