// For tests of the conformance kit: exports a function besides the entry.
#include "sound.h"

extern "C" RELIGN_EXPORT int helper_of_two_symbols();
extern "C" int helper_of_two_symbols() { return 7; }

namespace {

class Saboteur final : public relign::Optimizer {
 public:
  explicit Saboteur(const relign::Parameters&) {}
  void run(relign::Conversation& talk) override {
    saboteur::search(talk, [](const relign::Observation&, relign::Pose&) {});
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
