// For tests of the conformance kit: sound, but built with -ffast-math, whose start-up code changes the loading thread.
#include "sound.h"

namespace {

class Saboteur final : public relign::Optimizer {
 public:
  explicit Saboteur(const relign::Parameters&) {}
  void run(relign::Conversation& talk) override {
    saboteur::search(talk, [](const relign::Observation&, relign::Pose&) {});
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
