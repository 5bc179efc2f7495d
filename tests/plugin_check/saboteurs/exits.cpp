// For tests of the conformance kit: ends the process.
#include <cstdlib>

#include "sound.h"

namespace {

class Saboteur final : public relign::Optimizer {
 public:
  explicit Saboteur(const relign::Parameters&) {}
  void run(relign::Conversation& talk) override {
    saboteur::search(talk, [](const relign::Observation& seen, relign::Pose&) {
      if (seen.step == 5) std::exit(0);
    });
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
