// For tests of the conformance checks: refuses any number of axes except five.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void before_first(relign::Trial& trial) override {
    if (trial.axes() != 5) throw std::invalid_argument("it supports only five axes");
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
