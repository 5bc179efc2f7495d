// For tests of the conformance kit: dies of a merit that is no number.
#include <cmath>
#include <csignal>

#include "sound.h"

namespace {

class Saboteur final : public relign::Optimizer {
 public:
  explicit Saboteur(const relign::Parameters&) {}
  void run(relign::Conversation& talk) override {
    saboteur::search(talk, [](const relign::Observation& seen, relign::Pose&) {
      if (std::isnan(seen.merit)) std::raise(SIGSEGV);
    });
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
