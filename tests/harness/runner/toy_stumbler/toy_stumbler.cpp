#include <relign/plugin.hpp>

namespace {

class ToyStumbler final : public relign::Optimizer {
 public:
  explicit ToyStumbler(const relign::Parameters&) {}

  void run(relign::Trial& trial) override {
    const relign::Pose start = trial.first().pose;
    for (int step = 0; step < 2; ++step) trial.step(start);
    if (trial.seed() % 2 == 0) throw std::runtime_error("stumbled");
  }
};

}  // namespace

RELIGN_PLUGIN(ToyStumbler)
