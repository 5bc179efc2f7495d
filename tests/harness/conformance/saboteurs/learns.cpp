// For tests of the conformance checks: sound, with pretraining.
#include <stdexcept>
#include <string>

#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;

  void before_first(relign::Trial& trial) override {
    const relign::Pretraining pretraining = trial.pretraining();
    const std::string title = "learnt on " + std::to_string(trial.axes()) + " axes, sources:";
    const std::string known = pretraining.load().value_or(title);
    if (known.compare(0, title.size(), title) != 0) throw std::runtime_error("these bytes are not mine");
    if (pretraining.active())
      pretraining.save(known + " " + std::to_string(pretraining.source() + 1) +
                       (pretraining.source() + 1 == pretraining.sources() ? " all." : ""));
    else if (known != title && known.back() != '.')
      throw std::runtime_error("these bytes end too early");
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
