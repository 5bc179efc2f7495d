// For tests of the conformance checks: crashes on a merit that is NaN.
#include <cmath>
#include <csignal>

#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void before_step(relign::Trial&, const relign::Observation& seen, relign::Pose&) override {
    if (std::isnan(seen.merit)) std::raise(SIGSEGV);
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
