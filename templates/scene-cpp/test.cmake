# What my_plugin promises, checked by running trials. relign_test_plugin gives trial, value_at, step_count, fail
# and PLUGIN_FOLDER, the built plugin.

# home moves to the nominal pose. With perfect elements that is nearly the optimum (the stage is distorted a
# little), so the truth there must be below the truth at the start.
foreach(instance 0 1 2)
  trial(home home --scene "${PLUGIN_FOLDER}" --noise-level rho0 --instance ${instance})
  value_at(start "${home}" 0 commanded_mse)
  value_at(nominal "${home}" 1 commanded_mse)
  if(NOT nominal LESS start)
    fail("instance ${instance}: the truth is ${start} at the start and ${nominal} at the nominal pose")
  endif()
  # What is measured holds the noise besides the difference.
  value_at(measured "${home}" 1 measured)
  if(NOT measured GREATER 0.005)
    fail("instance ${instance}: a capture has noise, but ${measured} was measured at the nominal pose")
  endif()
endforeach()

# Elements matter: the same instance with offsets has another truth at the nominal pose.
trial(offset home --scene "${PLUGIN_FOLDER}" --noise-level rho0.5 --instance 2)
value_at(with_offsets "${offset}" 1 commanded_mse)
if(with_offsets EQUAL nominal)
  fail("the offsets of the elements change nothing")
endif()

# It can be searched, and the same trial gives the same images.
trial(found nlopt-sbplx --scene "${PLUGIN_FOLDER}" --noise-level rho0.25 --steps 80)
trial(again nlopt-sbplx --scene "${PLUGIN_FOLDER}" --noise-level rho0.25 --steps 80)
value_at(before "${found}" 0 recommended_mse)
value_at(after "${found}" last recommended_mse)
if(NOT after LESS before)
  fail("a search went from ${before} to ${after}")
endif()
if(NOT again STREQUAL found)
  fail("two runs of one trial differ; an image must be a pure function of pose and frame seed")
endif()
