// For tests of the conformance checks: leaks 4000 bytes in every trial.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void after_last(relign::Trial&) override { kept = new char[4000]; }
  static inline char* volatile kept = nullptr;
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
