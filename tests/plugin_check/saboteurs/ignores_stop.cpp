// For tests of the conformance kit: never returns once it is stopped.
#include "sound.h"

namespace {

class Saboteur final : public relign::Optimizer {
 public:
  explicit Saboteur(const relign::Parameters&) {}
  void run(relign::Conversation& talk) override {
    saboteur::search(talk, [](const relign::Observation&, relign::Pose&) {});
    volatile bool busy = true;
    while (busy) {
    }
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
