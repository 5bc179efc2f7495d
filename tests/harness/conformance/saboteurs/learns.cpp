// For tests of the conformance checks: sound, with pretraining.
#include <stdexcept>
#include <string>

#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;

  void before_first(relign::Conversation& talk) override {
    const relign::Prepared prepared = talk.prepared();
    const std::string title = "learnt on " + std::to_string(talk.axes()) + " axes, sources:";
    const std::string known = prepared.load().value_or(title);
    if (known.compare(0, title.size(), title) != 0) throw std::runtime_error("these bytes are not mine");
    if (prepared.preparing())
      prepared.save(known + " " + std::to_string(prepared.source() + 1) +
                    (prepared.source() + 1 == prepared.sources() ? " all." : ""));
    else if (known != title && known.back() != '.')
      throw std::runtime_error("these bytes end too early");
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
