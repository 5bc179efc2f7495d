// For tests of the conformance kit: never returns once it is stopped.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void after_last(relign::Conversation&) override {
    volatile bool busy = true;
    while (busy) {
    }
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
