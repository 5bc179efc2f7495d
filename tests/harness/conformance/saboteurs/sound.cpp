// For tests of the conformance checks: sound; recommends nothing, which is allowed.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
