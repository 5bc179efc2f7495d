// For tests of the conformance kit: forgets 4000 bytes in every trial.
#include "sound.h"

namespace {

char* volatile kept;

class Saboteur final : public relign::Optimizer {
 public:
  explicit Saboteur(const relign::Parameters&) {}
  void run(relign::Conversation& talk) override {
    saboteur::search(talk, [](const relign::Observation&, relign::Pose&) {});
    kept = new char[4000];
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
