// An algorithm without computation, for measuring the overhead of the harness.
#include <relign/plugin.hpp>

namespace {

class NullWalker final : public relign::Optimizer {
 public:
  explicit NullWalker(const relign::Parameters&) {}
  void run(relign::Trial& trial) override {
    relign::Pose pose(trial.axes(), 0.1);
    for (double place = 0; trial.step(pose); place += 1e-7) pose[0] = place;
  }
};

}  // namespace

RELIGN_PLUGIN(NullWalker)
