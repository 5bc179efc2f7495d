// The base of all saboteurs: a small, sound search, in which each overrides one function.
#pragma once

#include <relign/plugin.hpp>
#include <relign/random.hpp>

namespace saboteur {

// Draws poses from the box until it is stopped.
class Sound : public relign::Optimizer {
 public:
  explicit Sound(const relign::Parameters&) {}

  void run(relign::Trial& trial) override {
    before_first(trial);
    const relign::Box box = trial.box();
    std::optional<relign::Observation> seen = trial.first();
    for (std::uint64_t step = 1; seen; ++step) {
      relign::Random random(trial.seed(), step);
      relign::Pose pose(trial.axes());
      for (std::size_t axis = 0; axis < pose.size(); ++axis)
        pose[axis] = box.lower[axis] + (box.upper[axis] - box.lower[axis]) * random.uniform();
      before_step(trial, *seen, pose);
      if (stopped_) break;
      seen = trial.step(pose);
    }
    after_last(trial);
  }

 protected:
  virtual void before_first(relign::Trial&) {}
  virtual void before_step(relign::Trial&, const relign::Observation&, relign::Pose&) {}
  virtual void after_last(relign::Trial&) {}
  bool stopped_ = false;  // set by subclasses that have received a stop
};

}  // namespace saboteur
