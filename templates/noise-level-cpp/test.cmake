# What my_plugin promises, checked by running trials. relign_test_plugin gives trial, value_at, step_count, fail
# and PLUGIN_FOLDER, the built plugin.

# Starts are within 0.3 of the middle of the travel, and differ from instance to instance.
set(seen "")
foreach(instance 0 1 2 3 4)
  trial(home home --noise-level "${PLUGIN_FOLDER}" --instance ${instance})
  value_at(pose "${home}" 0 true_pose)
  string(JSON axes LENGTH "${pose}")
  math(EXPR last "${axes} - 1")
  foreach(axis RANGE ${last})
    value_at(coordinate "${home}" 0 true_pose ${axis})
    if(coordinate LESS 0.2 OR coordinate GREATER 0.8)
      fail("instance ${instance} starts at ${coordinate} on axis ${axis}")
    endif()
    if(coordinate IN_LIST seen)
      fail("instance ${instance}: ${coordinate} was drawn before")
    endif()
    list(APPEND seen "${coordinate}")
  endforeach()
endforeach()

# An instance is a pure function of its number.
trial(again home --noise-level "${PLUGIN_FOLDER}" --instance 4)
if(NOT again STREQUAL home)
  fail("instance 4 was drawn twice and differs; is all randomness drawn from the seed?")
endif()
