#include <unistd.h>

#include <relign/plugin.hpp>
#include <string>

namespace {

// Pauses a job until a test continues it, so that tests do not depend on the machine's speed.
class ToyPatient final : public relign::Optimizer {
 public:
  explicit ToyPatient(const relign::Parameters& given) : gate_(given.text("gate")) {}

  void run(relign::Conversation& talk) override {
    while (!gate_.empty() && ::access(gate_.c_str(), F_OK) != 0) ::usleep(20000);
    relign::Random random(talk.seed());
    const relign::Box box = talk.box();
    relign::Pose pose = talk.first().pose;
    while (true) {
      for (double& coordinate : pose) coordinate += 0.1 * random.normal();
      pose = box.clamp(pose);
      const auto seen = talk.step(pose);
      if (!seen) return;
      talk.recommend(seen->pose);
    }
  }

 private:
  std::string gate_;
};

}  // namespace

RELIGN_PLUGIN(ToyPatient)
