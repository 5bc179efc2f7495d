// random: uniform random search, the baseline. See README.md.
#include <relign/plugin.hpp>

namespace {

class RandomSearch final : public relign::Optimizer {
 public:
  explicit RandomSearch(const relign::Parameters&) {}

  void run(relign::Trial& trial) override {
    const relign::Box box = trial.box();
    relign::Random random(trial.seed());
    relign::Pose pose(trial.axes());
    do {
      for (std::size_t axis = 0; axis < pose.size(); ++axis)
        pose[axis] = std::min(random.uniform(box.lower[axis], box.upper[axis]), box.upper[axis]);
    } while (trial.step(pose));
  }
};

}  // namespace

RELIGN_PLUGIN(RandomSearch)
