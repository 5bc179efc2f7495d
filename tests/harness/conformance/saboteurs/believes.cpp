// For tests of the conformance checks: accepts any bytes as its own data.
#include <string>

#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;

  void before_first(relign::Conversation& talk) override {
    const relign::Prepared prepared = talk.prepared();
    const std::string known = prepared.load().value_or("");
    if (prepared.preparing()) prepared.save(known + "x");
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
