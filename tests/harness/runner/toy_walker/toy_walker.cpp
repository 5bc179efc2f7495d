#include <relign/plugin.hpp>

#ifndef TOY_WALKER_STRIDE
#define TOY_WALKER_STRIDE 0.2
#endif

namespace {

class ToyWalker final : public relign::Optimizer {
 public:
  explicit ToyWalker(const relign::Parameters&) {}

  void run(relign::Conversation& talk) override {
    relign::Random random(talk.seed());
    const relign::Box box = talk.box();
    relign::Observation best = talk.first();
    while (true) {
      relign::Pose candidate = best.pose;
      for (double& coordinate : candidate) coordinate += TOY_WALKER_STRIDE * random.normal();
      const auto seen = talk.step(box.clamp(candidate));
      if (!seen) return;
      if (seen->merit < best.merit) {
        best = *seen;
        talk.recommend(best.pose);
      }
    }
  }
};

}  // namespace

RELIGN_PLUGIN(ToyWalker)
