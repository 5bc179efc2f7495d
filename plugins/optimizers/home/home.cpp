// home: moves to the nominal pose of the design. See README.md.
#include <relign/plugin.hpp>

namespace {

class Home final : public relign::Optimizer {
 public:
  explicit Home(const relign::Parameters&) {}

  void run(relign::Conversation& talk) override {
    const relign::Pose nominal(talk.axes(), 0.5);  // in coordinates of the stage, because the start is observed
    if (talk.step(nominal)) talk.recommend(nominal);
  }
};

}  // namespace

RELIGN_PLUGIN(Home)
