// cma-es: CMA-ES in a box, with restarts. See README.md.
#include <numeric>
#include <relign/plugin.hpp>

#include "cma.h"
#include "least_squares/poses.hpp"

namespace {

using cma_es::Vector;
using least_squares::to_pose;
using least_squares::to_vector;

constexpr int kMaxRestarts = 9;  // as Auger and Hansen; each doubles the population
constexpr int kMinPopulation = 4;
constexpr int kMaxPopulation = 4096;
constexpr int kFlatGenerations = 5;
constexpr double kWorstCondition = 1e14;

class CmaEs final : public relign::Optimizer {
 public:
  explicit CmaEs(const relign::Parameters& given)
      : stride_(given.number("first_stride")),
        tolerance_(given.number("tolerance")),
        population_(static_cast<int>(given.integer("population"))) {
    if (population_ != 0 && population_ < kMinPopulation)
      throw std::invalid_argument("parameter 'population': found '" + std::to_string(population_) +
                                  "', must be 0 (the default population) or at least 4");
  }

  void run(relign::Trial& trial) override {
    trial_ = &trial;
    box_ = trial.box();
    const int axes = static_cast<int>(trial.axes());
    relign::Random random(trial.seed());
    int population = population_ > 0 ? population_ : cma_es::Constants::usual_population(axes);
    Vector start = to_vector(box_.clamp(trial.first().pose));
    for (int restart = 0; restart <= kMaxRestarts; ++restart) {
      if (!search(start, std::min(population, kMaxPopulation), random)) return;
      for (int axis = 0; axis < axes; ++axis) start[axis] = random.uniform(box_.lower[axis], box_.upper[axis]);
      population *= 2;
      if (population > kMaxPopulation) return;
    }
  }

 private:
  struct Drawn {
    Vector point;       // as drawn, may be outside the box
    double away2 = 0;   // squared distance to the box, in strides
    double merit = 0;   // of the nearest pose in the box
    double ranked = 0;  // the merit plus the penalty for the distance
  };

  // Runs one search. Returns false when no step is left.
  bool search(const Vector& start, int population, relign::Random& random) {
    Vector stride(start.size());
    for (long axis = 0; axis < start.size(); ++axis) {  // shorter strides in a narrow box
      const double width = box_.upper[size_t(axis)] - box_.lower[size_t(axis)];
      stride[axis] = width > 0 ? std::min(stride_, width / 2) : stride_;
    }
    cma_es::Evolution evolution(start, stride, population);
    int flat = 0;
    while (flat < kFlatGenerations && evolution.spread() * stride_ >= tolerance_ &&
           evolution.condition() < kWorstCondition) {
      std::vector<Drawn> generation(static_cast<size_t>(population));
      for (Drawn& drawn : generation)
        if (!measure(evolution, stride, random, drawn)) return false;
      const bool distinct = rank(generation, evolution.spread());
      flat = distinct ? 0 : flat + 1;
      if (!distinct) continue;  // an arbitrary ranking would make the mean drift
      std::vector<Vector> ranked;
      for (const Drawn& drawn : generation) ranked.push_back(drawn.point);
      evolution.learn(ranked);
      if (!confirmed_) trial_->recommend(box_.clamp(to_pose(evolution.mean())));
    }
    return confirm(box_.clamp(to_pose(evolution.mean())));
  }

  bool measure(const cma_es::Evolution& evolution, const Vector& stride, relign::Random& random, Drawn& drawn) {
    drawn.point = evolution.draw(random);
    const relign::Pose pose = box_.clamp(to_pose(drawn.point));
    drawn.away2 = (drawn.point - to_vector(pose)).cwiseQuotient(stride).squaredNorm();
    const auto observation = trial_->step(pose);
    if (!observation) return false;
    drawn.merit = observation->merit;
    return true;
  }

  // Sorts by merit, best first; a non-finite merit is ranked last. Returns false if all are equal.
  static bool rank(std::vector<Drawn>& generation, double spread) {
    double best = std::numeric_limits<double>::infinity(), worst = -best;
    for (const Drawn& drawn : generation)
      if (std::isfinite(drawn.merit)) {
        best = std::min(best, drawn.merit);
        worst = std::max(worst, drawn.merit);
      }
    const bool all_finite = std::all_of(generation.begin(), generation.end(),
                                        [](const Drawn& drawn) { return std::isfinite(drawn.merit); });
    if (best > worst || (best == worst && all_finite)) return false;
    // The penalty is the generation's range of merits per squared spread of the draws, so it is independent of the unit
    // of the merit. Merits are halved so that the range of values near 1e308 does not overflow.
    const double range = worst / 2 - best / 2;
    for (Drawn& drawn : generation) {
      const double merit = std::isfinite(drawn.merit) ? drawn.merit / 2 - best / 2 : range;
      drawn.ranked = merit + range * drawn.away2 / (spread * spread);
      if (!std::isfinite(drawn.merit)) drawn.ranked = std::numeric_limits<double>::infinity();
    }
    std::stable_sort(generation.begin(), generation.end(),
                     [](const Drawn& a, const Drawn& b) { return a.ranked < b.ranked; });
    return true;
  }

  // Measures the end of a search; of several searches the one with the lowest end is recommended.
  bool confirm(const relign::Pose& end) {
    const auto observation = trial_->step(end);
    if (!observation) return false;
    if (std::isfinite(observation->merit) && (!confirmed_ || observation->merit < lowest_end_)) {
      lowest_end_ = observation->merit;
      confirmed_ = true;
      trial_->recommend(end);
    }
    return true;
  }

  double stride_;     // share of the travel
  double tolerance_;  // share of the travel
  int population_;    // 0: the default
  relign::Trial* trial_ = nullptr;
  relign::Box box_;
  bool confirmed_ = false;  // a search has ended at lowest_end_
  double lowest_end_ = 0;
};

}  // namespace

RELIGN_PLUGIN(CmaEs)
