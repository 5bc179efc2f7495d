// For tests of the conformance checks: a preset creates an object that cannot run.
#include "sound.h"

namespace {

class Saboteur final : public saboteur::Sound {
 public:
  explicit Saboteur(const relign::Parameters& given) : Sound(given), moody_(given.integer("mood") == 2) {}

 private:
  void after_last(relign::Trial&) override {
    if (moody_) throw std::runtime_error("not in this mood");
  }
  bool moody_;
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
