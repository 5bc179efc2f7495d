// For tests of the conformance kit: asks for step 0 when it has left it.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void before_step(relign::Conversation& talk, const relign::Observation& seen, relign::Pose&) override {
    if (seen.step == 3) talk.first();
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
