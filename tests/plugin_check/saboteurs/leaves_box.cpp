// For tests of the conformance kit: commands poses outside its box.
#include "sound.h"

namespace {

class Saboteur final : public relign::Optimizer {
 public:
  explicit Saboteur(const relign::Parameters&) {}
  void run(relign::Conversation& talk) override {
    saboteur::search(talk, [](const relign::Observation& seen, relign::Pose& pose) {
      if (seen.step == 7) pose[0] = 3;
    });
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
