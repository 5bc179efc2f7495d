// Random local search, the (1+1) evolution strategy: step away from the best pose, keep what is better.
#include <relign/plugin.hpp>

class MyPlugin final : public relign::Optimizer {
 public:
  explicit MyPlugin(const relign::Parameters& given) : stride_(given.number("first_stride")) {}

  void run(relign::Trial& trial) override {
    const relign::Box box = trial.box();       // commanded coordinates, under every protocol
    relign::Random random(trial.seed());       // same seed, same trial
    relign::Observation best = trial.first();  // step 0: the capture at the start pose
    while (stride_ > 1e-4) {                   // finer moves mean nothing to the stage: finished
      relign::Pose candidate = best.pose;
      for (double& coordinate : candidate) coordinate += stride_ * random.normal();
      const auto seen = trial.step(box.clamp(candidate));  // one move + one capture
      if (!seen) return;                                   // budget spent: not an error
      if (seen->merit < best.merit) {
        best = *seen;
        trial.recommend(best.pose);  // where I would fix the lens now
        stride_ *= 1.5;
      } else {
        stride_ *= 0.9;  // in balance when one move in five is a success
      }
    }
  }

 private:
  double stride_;  // share of the travel
};

RELIGN_PLUGIN(MyPlugin)
