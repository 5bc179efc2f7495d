// For tests of the conformance checks: sound, but built with -ffast-math, whose start-up code changes the loading
// thread.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
