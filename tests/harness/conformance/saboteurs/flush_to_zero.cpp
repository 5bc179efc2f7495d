// For tests of the conformance checks: leaves flush-to-zero on.
#include <xmmintrin.h>

#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void before_first(relign::Trial&) override { _mm_setcsr(_mm_getcsr() | 0x8040); }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
