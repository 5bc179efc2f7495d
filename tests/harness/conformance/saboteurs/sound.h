// The base of all saboteurs: a small, sound search, in which each overrides one function.
#pragma once

#include <relign/plugin.hpp>
#include <relign/random.hpp>

namespace saboteur {

// Draws poses from the box until it is stopped.
class Sound : public relign::Optimizer {
 public:
  explicit Sound(const relign::Parameters&) {}

  void run(relign::Conversation& talk) override {
    before_first(talk);
    const relign::Box box = talk.box();
    std::optional<relign::Observation> seen = talk.first();
    for (std::uint64_t step = 1; seen; ++step) {
      relign::Random random(talk.seed(), step);
      relign::Pose pose(talk.axes());
      for (std::size_t axis = 0; axis < pose.size(); ++axis)
        pose[axis] = box.lower[axis] + (box.upper[axis] - box.lower[axis]) * random.uniform();
      before_step(talk, *seen, pose);
      if (stopped_) break;
      seen = talk.step(pose);
    }
    after_last(talk);
  }

 protected:
  virtual void before_first(relign::Conversation&) {}
  virtual void before_step(relign::Conversation&, const relign::Observation&, relign::Pose&) {}
  virtual void after_last(relign::Conversation&) {}
  bool stopped_ = false;  // set by subclasses that have received a stop
};

}  // namespace saboteur
