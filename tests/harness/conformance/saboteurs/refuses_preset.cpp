// For tests of the conformance checks: cannot create one of its presets.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
 public:
  explicit Saboteur(const relign::Parameters& given) : Sound(given) {
    if (given.integer("mood") == 2) throw std::invalid_argument("not in this mood");
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
