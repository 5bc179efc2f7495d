// What every saboteur does besides its one misdeed: a small, sound search.
#pragma once

#include <relign/plugin.hpp>
#include <relign/random.hpp>

namespace saboteur {

// Draws poses from the box until it is stopped, and calls `before_step` at each.
template <class BeforeStep>
void search(relign::Conversation& talk, BeforeStep&& before_step) {
  const relign::Box box = talk.box();
  std::optional<relign::Observation> seen = talk.first();
  for (std::uint64_t step = 1; seen; ++step) {
    relign::Random random(talk.seed(), step);
    relign::Pose pose(talk.axes());
    for (std::size_t axis = 0; axis < pose.size(); ++axis)
      pose[axis] = box.lower[axis] + (box.upper[axis] - box.lower[axis]) * random.uniform();
    before_step(*seen, pose);
    seen = talk.step(pose);
  }
}

}  // namespace saboteur
