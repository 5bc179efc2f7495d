// For tests of the conformance checks: accepts any bytes as its own data.
#include <string>

#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;

  void before_first(relign::Trial& trial) override {
    const relign::Pretraining pretraining = trial.pretraining();
    const std::string known = pretraining.load().value_or("");
    if (pretraining.active()) pretraining.save(known + "x");
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
