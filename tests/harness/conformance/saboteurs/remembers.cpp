// For tests of the conformance checks: continues where the last trial of the process ended.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void before_step(relign::Trial&, const relign::Observation&, relign::Pose& pose) override {
    pose[0] = 0.5 * pose[0] + 1e-6 * static_cast<double>(++steps_of_all_trials);
  }
  static inline std::uint64_t steps_of_all_trials = 0;
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
