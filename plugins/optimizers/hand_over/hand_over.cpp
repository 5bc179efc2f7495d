// hand-over: runs one algorithm for some steps, then another one from its result. See README.md.
#include <relign/plugin.hpp>

namespace {

class HandOver final : public relign::Optimizer {
 public:
  explicit HandOver(const relign::Parameters& given)
      : first_steps_(static_cast<unsigned>(given.integer("first_steps"))), from_(given.text("from")) {}

  void run(relign::Trial& trial) override {
    const unsigned budget = trial.budget();
    if (budget == 0) return;  // `run` needs at least one step
    const unsigned granted = std::min(first_steps_, budget);
    const relign::RunOutcome first = trial.run("first", granted);
    if (!first.last) return;  // stopped
    const bool stopped = !first.finished && first.steps < granted;
    // The first recommendation is not forwarded here: it would stay in force until the second algorithm returns.
    // Without one the host uses the best measured pose.
    if (stopped || first.steps >= budget) return forward(trial, first);

    unsigned used = first.steps;
    if (const relign::Pose pose = start_of_second(first, trial.box()); pose != first.last->pose) {
      if (!trial.step(pose)) return;
      ++used;
    }
    if (used >= budget) return forward(trial, first);
    forward(trial, trial.run("then", budget - used));
  }

 private:
  relign::Pose start_of_second(const relign::RunOutcome& first, const relign::Box& box) const {
    if (from_ == "recommendation" && first.recommendation) return box.clamp(*first.recommendation);
    if (from_ != "last" && first.best) return box.clamp(first.best->pose);
    return first.last->pose;
  }

  static void forward(relign::Trial& trial, const relign::RunOutcome& outcome) {
    if (outcome.recommendation) trial.recommend(*outcome.recommendation);
  }

  unsigned first_steps_;
  std::string from_;
};

}  // namespace

RELIGN_PLUGIN(HandOver)
