// Hand-over: one algorithm for some steps, then another one from where it led. See README.md.
#include <relign/plugin.hpp>

namespace {

class HandOver final : public relign::Optimizer {
 public:
  explicit HandOver(const relign::Parameters& given)
      : first_steps_(static_cast<unsigned>(given.integer("first_steps"))), from_(given.text("from")) {}

  void run(relign::Conversation& talk) override {
    const unsigned budget = talk.budget();
    if (budget == 0) return;  // `run` takes no zero
    const unsigned granted = std::min(first_steps_, budget);
    const relign::RunOutcome first = talk.run("first", granted);
    if (!first.last) return;  // stopped
    const bool stopped = !first.finished && first.steps < granted;
    // Until the second one is heard the best measured pose counts: a recommendation made here would hold until the
    // second one returns, however much better the poses are that it finds.
    if (stopped || first.steps >= budget) return repeat(talk, first);

    unsigned used = first.steps;
    if (const relign::Pose pose = meeting_point(first, talk.box()); pose != first.last->pose) {
      if (!talk.step(pose)) return;
      ++used;
    }
    if (used >= budget) return repeat(talk, first);
    repeat(talk, talk.run("then", budget - used));
  }

 private:
  // Where the second one starts.
  relign::Pose meeting_point(const relign::RunOutcome& first, const relign::Box& box) const {
    if (from_ == "recommendation" && first.recommendation) return box.clamp(*first.recommendation);
    if (from_ != "last" && first.best) return box.clamp(first.best->pose);
    return first.last->pose;
  }

  static void repeat(relign::Conversation& talk, const relign::RunOutcome& outcome) {
    if (outcome.recommendation) talk.recommend(*outcome.recommendation);
  }

  unsigned first_steps_;
  std::string from_;
};

}  // namespace

RELIGN_PLUGIN(HandOver)
