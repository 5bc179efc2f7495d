// hand-over: runs one algorithm for some steps, then another one from its result. See README.md.
#include <relign/plugin.hpp>

namespace {

class HandOver final : public relign::Optimizer {
 public:
  explicit HandOver(const relign::Parameters& given)
      : first_steps_(static_cast<unsigned>(given.integer("first_steps"))), from_(given.text("from")) {}

  void run(relign::Conversation& talk) override {
    const unsigned budget = talk.budget();
    if (budget == 0) return;  // `run` needs at least one step
    const unsigned granted = std::min(first_steps_, budget);
    const relign::RunOutcome first = talk.run("first", granted);
    if (!first.last) return;  // stopped
    const bool stopped = !first.finished && first.steps < granted;
    // The first recommendation is not forwarded here: it would stay in force until the second algorithm returns.
    // Without one the host uses the best measured pose.
    if (stopped || first.steps >= budget) return forward(talk, first);

    unsigned used = first.steps;
    if (const relign::Pose pose = start_of_second(first, talk.box()); pose != first.last->pose) {
      if (!talk.step(pose)) return;
      ++used;
    }
    if (used >= budget) return forward(talk, first);
    forward(talk, talk.run("then", budget - used));
  }

 private:
  relign::Pose start_of_second(const relign::RunOutcome& first, const relign::Box& box) const {
    if (from_ == "recommendation" && first.recommendation) return box.clamp(*first.recommendation);
    if (from_ != "last" && first.best) return box.clamp(first.best->pose);
    return first.last->pose;
  }

  static void forward(relign::Conversation& talk, const relign::RunOutcome& outcome) {
    if (outcome.recommendation) talk.recommend(*outcome.recommendation);
  }

  unsigned first_steps_;
  std::string from_;
};

}  // namespace

RELIGN_PLUGIN(HandOver)
