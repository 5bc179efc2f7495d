// For tests of the conformance checks: keeps asking for steps after a stop.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void after_last(relign::Conversation& talk) override {
    for (int i = 0; i < 3; ++i) talk.step(relign::Pose(talk.axes(), 0.0));
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
