#include <relign/plugin.hpp>

namespace {

class ToyStumbler final : public relign::Optimizer {
 public:
  explicit ToyStumbler(const relign::Parameters&) {}

  void run(relign::Conversation& talk) override {
    const relign::Pose start = talk.first().pose;
    for (int step = 0; step < 2; ++step) talk.step(start);
    if (talk.seed() % 2 == 0) throw std::runtime_error("stumbled");
  }
};

}  // namespace

RELIGN_PLUGIN(ToyStumbler)
