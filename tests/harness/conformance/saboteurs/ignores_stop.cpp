// For tests of the conformance checks: does not return after a stop.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void after_last(relign::Trial&) override {
    volatile bool busy = true;
    while (busy) {
    }
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
