// For tests of the conformance kit: opens a file in every trial and never closes it.
#include <fcntl.h>

#include "sound.h"

namespace {

class Saboteur final : public relign::Optimizer {
 public:
  explicit Saboteur(const relign::Parameters&) {}
  void run(relign::Conversation& talk) override {
    if (::open("/dev/null", O_RDONLY) < 0) throw std::runtime_error("open");
    saboteur::search(talk, [](const relign::Observation&, relign::Pose&) {});
  }
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
