#include <relign/plugin.hpp>

#ifndef TOY_WALKER_STRIDE
#define TOY_WALKER_STRIDE 0.2
#endif

namespace {

class ToyWalker final : public relign::Optimizer {
 public:
  explicit ToyWalker(const relign::Parameters&) {}

  void run(relign::Trial& trial) override {
    relign::Random random(trial.seed());
    const relign::Box box = trial.box();
    relign::Observation best = trial.first();
    while (true) {
      relign::Pose candidate = best.pose;
      for (double& coordinate : candidate) coordinate += TOY_WALKER_STRIDE * random.normal();
      const auto seen = trial.step(box.clamp(candidate));
      if (!seen) return;
      if (seen->merit < best.merit) {
        best = *seen;
        trial.recommend(best.pose);
      }
    }
  }
};

}  // namespace

RELIGN_PLUGIN(ToyWalker)
