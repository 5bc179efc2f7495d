// For tests of the conformance kit: sets an environment variable.
#include <cstdlib>

#include "sound.h"

namespace {

class Saboteur final : public relign::Optimizer {
 public:
  explicit Saboteur(const relign::Parameters&) {}
  void run(relign::Conversation& talk) override {
    ::setenv("OMP_NUM_THREADS", "1", 1);
    saboteur::search(talk, [](const relign::Observation&, relign::Pose&) {});
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
