// bo-turbo: Bayesian optimisation in a trust region. See README.md.
#include <relign/plugin.hpp>

#include "search.hpp"
#include "surrogates/candidates.hpp"

namespace {

class BoTurbo final : public relign::Optimizer {
 public:
  explicit BoTurbo(const relign::Parameters& given) : use_start_(given.boolean("use_start")) {
    setup_.initial_points = static_cast<std::size_t>(given.integer("initial_points"));
    setup_.candidates = static_cast<std::size_t>(given.integer("candidates"));
    setup_.exact_points = static_cast<std::size_t>(given.integer("exact_points"));
  }

  // Recommends nothing: the host then takes the best measured pose, as the authors do.
  void run(relign::Trial& trial) override {
    const surrogates::UnitBox box(trial.box());
    const relign::Observation first = trial.first();
    bo_turbo::Search search(trial.axes(), setup_, trial.seed());
    if (use_start_) search.tell(box.to_unit(first.pose), first.merit);
    for (unsigned step = 0; step < trial.budget(); ++step) {
      const auto observation = trial.step(box.to_pose(search.ask()));
      if (!observation) return;
      search.tell(box.to_unit(observation->pose), observation->merit);
    }
  }

 private:
  bo_turbo::Setup setup_;
  bool use_start_;
};

}  // namespace

RELIGN_PLUGIN(BoTurbo)
