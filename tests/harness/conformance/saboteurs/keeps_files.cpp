// For tests of the conformance checks: opens a file in every trial and never closes it.
#include <fcntl.h>

#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void before_first(relign::Trial&) override {
    if (::open("/dev/null", O_RDONLY) < 0) throw std::runtime_error("open");
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
