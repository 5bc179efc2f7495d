// For tests of the conformance checks: replaces a signal handler.
#include <csignal>

#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void before_first(relign::Trial&) override { std::signal(SIGUSR2, SIG_IGN); }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
