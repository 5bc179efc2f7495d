// For tests of the conformance checks: sound, with its own standard library (-static-libstdc++).
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
