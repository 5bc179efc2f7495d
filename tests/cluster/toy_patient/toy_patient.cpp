#include <unistd.h>

#include <relign/plugin.hpp>
#include <string>

namespace {

// Pauses a job until a test continues it, so that tests do not depend on the machine's speed.
class ToyPatient final : public relign::Optimizer {
 public:
  explicit ToyPatient(const relign::Parameters& given) : gate_(given.text("gate")) {}

  void run(relign::Trial& trial) override {
    while (!gate_.empty() && ::access(gate_.c_str(), F_OK) != 0) ::usleep(20000);
    relign::Random random(trial.seed());
    const relign::Box box = trial.box();
    relign::Pose pose = trial.first().pose;
    while (true) {
      for (double& coordinate : pose) coordinate += 0.1 * random.normal();
      pose = box.clamp(pose);
      const auto seen = trial.step(pose);
      if (!seen) return;
      trial.recommend(seen->pose);
    }
  }

 private:
  std::string gate_;
};

}  // namespace

RELIGN_PLUGIN(ToyPatient)
