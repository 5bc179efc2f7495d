// aim-off: aligns with another algorithm, and recommends its pose less the shift that curing is expected to add.
#include <algorithm>
#include <relign/plugin.hpp>

namespace {

class AimOff final : public relign::Optimizer {
 public:
  explicit AimOff(const relign::Parameters& given)
      : modules_(static_cast<unsigned>(given.integer("modules"))), doubt_(given.number("doubt")) {}

  void run(relign::Trial& trial) override {
    if (trial.budget() == 0) return;  // `run` needs at least one step
    const relign::RunOutcome aligned = trial.run("algorithm", trial.budget());
    if (!aligned.last) return;  // stopped
    relign::Pose pose = aligned.recommendation ? *aligned.recommendation : aligned.best.value_or(*aligned.last).pose;
    const relign::Pose expected = expected_shift(trial.history(), pose.size());
    for (std::size_t i = 0; i < pose.size(); ++i) pose[i] -= expected[i];
    trial.recommend(pose);
  }

 private:
  // Posterior mean of the batch's shift, per axis: normal modules about a normal batch mean.
  relign::Pose expected_shift(const relign::History& history, std::size_t axes) const {
    relign::Pose sum(axes, 0.0);
    const unsigned used = std::min(modules_, history.modules());
    for (unsigned back = 1; back <= used; ++back) {
      const relign::Pose shift = history.cure_shift(back);
      for (std::size_t i = 0; i < axes; ++i) sum[i] += shift[i];
    }
    for (double& value : sum) value = used > 0 ? value / (used + doubt_) : 0;
    return sum;
  }

  unsigned modules_;
  double doubt_;
};

}  // namespace

RELIGN_PLUGIN(AimOff)
