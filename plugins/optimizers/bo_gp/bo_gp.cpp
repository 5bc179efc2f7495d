// bo-gp: Bayesian optimisation with a Gaussian process. See README.md.
#include <relign/plugin.hpp>

#include "proposer.hpp"
#include "surrogates/candidates.hpp"

namespace {

using surrogates::Acquisition;

std::vector<Acquisition> portfolio_from_name(const std::string& name) {
  if (name == "gp_hedge")
    return {Acquisition::expected_improvement, Acquisition::lower_bound, Acquisition::probability};
  if (name == "ei") return {Acquisition::expected_improvement};
  if (name == "log_ei") return {Acquisition::log_expected_improvement};
  if (name == "lcb") return {Acquisition::lower_bound};
  if (name == "pi") return {Acquisition::probability};
  throw std::invalid_argument("parameter 'acquisition': unknown acquisition '" + name + "'");
}

bo_gp::Recipe recipe_from(const relign::Parameters& given) {
  bo_gp::Recipe recipe;
  const auto count = [&](const char* name) { return static_cast<std::size_t>(given.integer(name)); };
  recipe.portfolio = portfolio_from_name(given.text("acquisition"));
  recipe.shape = given.text("kernel") == "rbf" ? surrogates::Shape::rbf : surrogates::Shape::matern52;
  recipe.initial_points = count("initial_points");
  recipe.latin = given.text("initial_design") == "latin";
  recipe.xi = given.number("xi");
  recipe.xi_relative = given.text("xi_unit") == "deviations";
  recipe.model_incumbent = given.text("incumbent") == "model";
  recipe.priors = given.boolean("priors");
  recipe.warp = given.boolean("warp");
  recipe.kappa = given.number("kappa");
  recipe.caution = given.number("caution");
  recipe.noise = given.number("noise");
  recipe.candidates = count("candidates");
  recipe.near_candidates = count("near_candidates");
  recipe.restarts = count("restarts");
  recipe.exact_points = count("exact_points");
  return recipe;
}

class BoGp final : public relign::Optimizer {
 public:
  explicit BoGp(const relign::Parameters& given)
      : recipe_(recipe_from(given)), use_start_(given.boolean("use_start")) {}

  void run(relign::Trial& trial) override {
    box_ = surrogates::UnitBox(trial.box());
    const relign::Observation first = trial.first();
    bo_gp::Proposer proposer(trial.axes(), recipe_, trial.seed());
    if (use_start_) take(trial, proposer, first);
    relign::Pose pose = box_.to_pose(proposer.ask());
    while (const auto observation = trial.step(pose)) {
      take(trial, proposer, *observation);
      // No proposal is needed after the last step.
      if (observation->step < trial.budget()) pose = box_.to_pose(proposer.ask());
    }
  }

 private:
  void take(relign::Trial& trial, bo_gp::Proposer& proposer, const relign::Observation& observation) const {
    proposer.tell(box_.to_unit(observation.pose), observation.merit);
    if (const auto& optimum = proposer.optimum()) trial.recommend(box_.to_pose(*optimum));
  }

  bo_gp::Recipe recipe_;
  bool use_start_;
  surrogates::UnitBox box_;
};

}  // namespace

RELIGN_PLUGIN(BoGp)
