// For tests of the conformance kit: goes on asking for steps once it is stopped.
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
