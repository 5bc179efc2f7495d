// An optimizer that throws, exits or crashes after its first step.
#include <cstdio>
#include <cstdlib>
#include <relign/plugin.hpp>
#include <stdexcept>
#include <string>

namespace {

class BreaksDown final : public relign::Optimizer {
 public:
  explicit BreaksDown(const relign::Parameters& given) : how_(given.text("how")) {}
  void run(relign::Trial& trial) override {
    trial.step(trial.box().centre());
    std::printf("the gripper slips\n");
    if (how_ == "exit") std::exit(0);
    if (how_ == "crash") std::abort();
    throw std::runtime_error("the gripper let go");
  }

 private:
  std::string how_;
};

}  // namespace

RELIGN_PLUGIN(BreaksDown)
