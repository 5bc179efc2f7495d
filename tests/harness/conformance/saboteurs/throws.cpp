// For tests of the conformance checks: throws.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void after_last(relign::Trial&) override { throw std::runtime_error("thrown on purpose"); }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
