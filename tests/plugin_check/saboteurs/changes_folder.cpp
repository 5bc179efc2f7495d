// For tests of the conformance kit: changes the working directory.
#include <unistd.h>

#include "sound.h"

namespace {

class Saboteur final : public relign::Optimizer {
 public:
  explicit Saboteur(const relign::Parameters&) {}
  void run(relign::Conversation& talk) override {
    if (::chdir("/") != 0) throw std::runtime_error("chdir");
    saboteur::search(talk, [](const relign::Observation&, relign::Pose&) {});
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
