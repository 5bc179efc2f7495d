// For tests of the conformance checks: saves no data in pretraining.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
