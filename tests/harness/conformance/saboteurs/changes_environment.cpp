// For tests of the conformance checks: sets an environment variable.
#include <cstdlib>

#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void before_first(relign::Trial&) override { ::setenv("OMP_NUM_THREADS", "1", 1); }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
