// For tests of the conformance checks: keeps asking for steps after a stop.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void after_last(relign::Trial& trial) override {
    for (int i = 0; i < 3; ++i) trial.step(relign::Pose(trial.axes(), 0.0));
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
