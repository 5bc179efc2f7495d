// For tests of the conformance kit: takes a signal for itself.
#include <csignal>

#include "sound.h"

namespace {

class Saboteur final : public relign::Optimizer {
 public:
  explicit Saboteur(const relign::Parameters&) {}
  void run(relign::Conversation& talk) override {
    std::signal(SIGUSR2, SIG_IGN);
    saboteur::search(talk, [](const relign::Observation&, relign::Pose&) {});
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
