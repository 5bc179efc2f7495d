// For tests of the conformance checks: changes the locale.
#include <clocale>

#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;
  void before_first(relign::Trial&) override { std::setlocale(LC_ALL, "C.UTF-8"); }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
