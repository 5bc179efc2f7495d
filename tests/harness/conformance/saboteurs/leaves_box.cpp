// For tests of the conformance checks: commands poses outside its box.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void before_step(relign::Trial&, const relign::Observation& seen, relign::Pose& pose) override {
    if (seen.step == 7) pose[0] = 3;
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
