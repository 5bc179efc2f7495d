// For tests of the conformance checks: requests step 0 again after the first step.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void before_step(relign::Trial& trial, const relign::Observation& seen, relign::Pose&) override {
    if (seen.step == 3) trial.first();
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
