// bo-forest: Bayesian optimisation with a forest of regression trees. See README.md.
#include <cmath>
#include <limits>

#include "forest.h"
#include "surrogates/acquisition.hpp"
#include "surrogates/candidates.hpp"
#include "surrogates/standard.hpp"

namespace {

using bo_forest::Forest;
using surrogates::Acquisition;
using surrogates::Vector;

// Random streams; trees use streams 0, 1, ... of another seed.
constexpr std::uint64_t kInitialStream = 0;
constexpr std::uint64_t kCandidateStream = 1;
constexpr std::uint64_t kForestSeed = 0x666f72657374;

bo_forest::ForestOptions options_from(const relign::Parameters& given) {
  bo_forest::ForestOptions options;
  options.tree.random_splits = given.text("splitter") == "random";
  options.tree.smallest_leaf = static_cast<std::size_t>(given.integer("min_samples_leaf"));
  options.bootstrap = given.boolean("bootstrap");
  options.total_variance = given.text("variance") == "total";
  options.trees = static_cast<std::size_t>(given.integer("trees"));
  return options;
}

class BoForest final : public relign::Optimizer {
 public:
  explicit BoForest(const relign::Parameters& given)
      : forest_(options_from(given)),
        initial_points_(given.integer("initial_points")),
        candidates_(static_cast<std::size_t>(given.integer("candidates"))),
        xi_(given.number("xi")),
        relative_xi_(given.boolean("relative_xi")),
        min_variance_(given.number("min_variance")) {}

  void run(relign::Trial& trial) override {
    const relign::Box box = trial.box();
    box_ = surrogates::UnitBox(box);
    seed_ = trial.seed();
    learnt_.axes = trial.axes();
    const relign::Observation first = trial.first();
    // The capture at the start pose is free, but counts only if the start is inside the box.
    if (std::isfinite(first.merit) && box.clamp(first.pose) == first.pose) take(first);
    relign::Random initial(seed_, kInitialStream);
    relign::Random candidates(seed_, kCandidateStream);
    for (std::int64_t step = 0;; ++step) {
      Vector next;
      if (step < initial_points_ || !fit()) {
        next = surrogates::uniform_point(initial, learnt_.axes);
      } else {
        trial.recommend(visited_[lowest_visited()]);
        next = propose(candidates);
      }
      const auto observation = trial.step(box_.to_pose(next));
      if (!observation) return;
      take(*observation);
    }
  }

 private:
  void take(const relign::Observation& observation) {
    for (const double share : box_.to_unit(observation.pose)) learnt_.features.push_back(static_cast<float>(share));
    merits_.push_back(observation.merit);
    visited_.push_back(observation.pose);
  }

  // Returns false if all merits are equal. Merits are standardised, which does not change splits but makes rounding
  // independent of offset and unit.
  bool fit() {
    const Vector merits = surrogates::usable_merits(merits_);
    const double best = merits.minCoeff();
    if (!(best < merits.maxCoeff())) return false;
    const surrogates::Standard standard(merits);
    const Vector targets = standard.apply(merits);
    learnt_.targets.assign(targets.begin(), targets.end());
    acquisition_.incumbent = (best - standard.mean) / standard.scale;
    acquisition_.xi = relative_xi_ ? xi_ : xi_ / standard.scale;
    forest_.fit(learnt_, seed_ ^ kForestSeed, min_variance_ / standard.scale / standard.scale);
    return true;
  }

  // The visited pose of the lowest predicted mean, which averages over neighbours and so is robust to a lucky capture;
  // ties are resolved by the measured merit.
  std::size_t lowest_visited() {
    forest_.predict(learnt_.features.data(), learnt_.axes, merits_.size(), prediction_);
    const auto rank = [&](std::size_t i) { return std::make_pair(prediction_.mean[i], learnt_.targets[i]); };
    std::size_t lowest = 0;
    for (std::size_t i = 1; i < merits_.size(); ++i)
      if (rank(i) < rank(lowest)) lowest = i;
    return lowest;
  }

  // The candidate of the greatest expected improvement; the first one if it is 0 everywhere.
  Vector propose(relign::Random& random) {
    const surrogates::Matrix points = surrogates::uniform_points(random, learnt_.axes, candidates_);
    const Eigen::MatrixXf features = points.cast<float>();
    forest_.predict(features.data(), learnt_.axes, candidates_, prediction_);
    std::size_t best = 0;
    double least = 0;
    for (std::size_t i = 0; i < candidates_; ++i) {
      const double mean = prediction_.mean[i];
      const double deviation = std::sqrt(prediction_.variance[i]);
      // An upper bound of the improvement, which avoids the exponential for most candidates.
      const double most = std::max(acquisition_.incumbent - acquisition_.xi - mean, 0.0) + 0.4 * deviation;
      if (-most > least) continue;
      const double cost = acquisition_cost(Acquisition::expected_improvement, acquisition_, mean, deviation).value;
      if (cost < least) {
        least = cost;
        best = i;
      }
    }
    return points.col(static_cast<Eigen::Index>(best));
  }

  Forest forest_;
  std::int64_t initial_points_;
  std::size_t candidates_;
  double xi_;
  bool relative_xi_;
  double min_variance_;  // in squared units of the merit
  surrogates::UnitBox box_;
  std::uint64_t seed_ = 0;
  std::vector<relign::Pose> visited_;
  std::vector<double> merits_;                // as measured
  bo_forest::Samples learnt_;                 // features: shares of the box; targets: standardised merits
  surrogates::AcquisitionSetup acquisition_;  // in units of the targets
  Forest::Prediction prediction_;
};

}  // namespace

RELIGN_PLUGIN(BoForest)
