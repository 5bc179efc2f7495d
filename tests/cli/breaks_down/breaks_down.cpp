// An optimizer that fails after its first step.
#include <relign/plugin.hpp>
#include <stdexcept>

namespace {

class BreaksDown final : public relign::Optimizer {
 public:
  explicit BreaksDown(const relign::Parameters&) {}
  void run(relign::Conversation& talk) override {
    talk.step(talk.box().centre());
    throw std::runtime_error("the gripper let go");
  }
};

}  // namespace

RELIGN_PLUGIN(BreaksDown)
