// For tests of the conformance checks: changes the working directory.
#include <unistd.h>

#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void before_first(relign::Trial&) override {
    if (::chdir("/") != 0) throw std::runtime_error("chdir");
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
