// For tests of the conformance kit: leaves subnormal numbers switched off.
#include <xmmintrin.h>

#include "sound.h"

namespace {

class Saboteur final : public relign::Optimizer {
 public:
  explicit Saboteur(const relign::Parameters&) {}
  void run(relign::Conversation& talk) override {
    _mm_setcsr(_mm_getcsr() | 0x8040);
    saboteur::search(talk, [](const relign::Observation&, relign::Pose&) {});
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
