// Helpers for tests of optimizers: a bowl-shaped merit.
#pragma once

#include "contract/run_plugin.h"  // IWYU pragma: export

namespace relign::test {

// Its minimum, 0.01, is off the centre and off every grid: at 0.17, -0.21, 0.17, ...
inline double off_centre_bowl(const Pose& pose) {
  Pose optimum(pose.size());
  for (std::size_t axis = 0; axis < pose.size(); ++axis) optimum[axis] = axis % 2 ? -0.21 : 0.17;
  return bowl(pose, optimum);
}

inline FakeSetup bowl_setup(std::uint32_t axes) {
  FakeSetup setup;
  setup.axes = axes;
  setup.merit = [](const Pose& pose, std::uint32_t) { return off_centre_bowl(pose); };
  return setup;
}

inline FakeSetup bowl_setup(std::uint32_t axes, std::uint32_t budget) {
  FakeSetup setup = bowl_setup(axes);
  setup.budget = budget;
  return setup;
}

}  // namespace relign::test
