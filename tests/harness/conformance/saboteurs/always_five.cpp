// For tests of the conformance checks: treats every task as one of five axes.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void before_step(relign::Trial&, const relign::Observation&, relign::Pose& pose) override { pose.resize(5, 0.0); }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
