#include <unistd.h>

#include <relign/plugin.hpp>

namespace {

class ToyMeddler final : public relign::Optimizer {
 public:
  explicit ToyMeddler(const relign::Parameters&) {}
  void run(relign::Trial& trial) override {
    trial.first();
    if (::chdir("/") != 0) throw std::runtime_error("cannot even meddle");
  }
};

}  // namespace

RELIGN_PLUGIN(ToyMeddler)
