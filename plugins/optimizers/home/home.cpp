// Home: what one gains by trusting the design and moving to its nominal pose.
#include <relign/plugin.hpp>

namespace {

class Home final : public relign::Optimizer {
 public:
  explicit Home(const relign::Parameters&) {}

  void run(relign::Conversation& talk) override {
    const relign::Pose nominal(talk.axes(), 0.5);  // in the stage's own coordinates, which knowing the start grants
    if (talk.step(nominal)) talk.recommend(nominal);
  }
};

}  // namespace

RELIGN_PLUGIN(Home)
