// For tests of the conformance kit: throws.
#include "sound.h"

namespace {

class Saboteur final : public relign::Optimizer {
 public:
  explicit Saboteur(const relign::Parameters&) {}
  void run(relign::Conversation& talk) override {
    saboteur::search(talk, [](const relign::Observation&, relign::Pose&) {});
    throw std::runtime_error("thrown on purpose");
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
