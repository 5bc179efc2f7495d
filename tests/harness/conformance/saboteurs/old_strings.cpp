// For tests of the conformance checks: sound, but built with the other layout of std::string
// (_GLIBCXX_USE_CXX11_ABI=0).
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
