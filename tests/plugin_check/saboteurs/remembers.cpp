// For tests of the conformance kit: goes on where the last trial of the process ended.
#include "sound.h"

namespace {

std::uint64_t steps_of_all_trials = 0;

class Saboteur final : public relign::Optimizer {
 public:
  explicit Saboteur(const relign::Parameters&) {}
  void run(relign::Conversation& talk) override {
    saboteur::search(talk, [](const relign::Observation&, relign::Pose& pose) {
      pose[0] = 0.5 * pose[0] + 1e-6 * static_cast<double>(++steps_of_all_trials);
    });
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
