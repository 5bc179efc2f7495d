// CMA-ES in a box, with restarts. See README.md.
#include <numeric>
#include <relign/plugin.hpp>

#include "cma.h"
#include "pictures/poses.hpp"

namespace {

using cma_es::Vector;
using pictures::to_pose;
using pictures::to_vector;

constexpr int kMostRestarts = 9;  // as Auger and Hansen do; the population is doubled each time
constexpr int kLeastPopulation = 4;
constexpr int kMostPopulation = 4096;  // beyond it a generation has no end
constexpr int kFlatGenerations = 5;
constexpr double kWorstCondition = 1e14;

class CmaEs final : public relign::Optimizer {
 public:
  explicit CmaEs(const relign::Parameters& given)
      : stride_(given.number("first_stride")),
        tolerance_(given.number("tolerance")),
        population_(static_cast<int>(given.integer("population"))) {
    if (population_ != 0 && population_ < kLeastPopulation)
      throw std::invalid_argument("population: expected 0 (the usual one) or at least 4, found " +
                                  std::to_string(population_));
  }

  void run(relign::Conversation& talk) override {
    talk_ = &talk;
    box_ = talk.box();
    const int axes = static_cast<int>(talk.axes());
    relign::Random random(talk.seed());
    int population = population_ > 0 ? population_ : cma_es::Constants::usual_population(axes);
    Vector start = to_vector(box_.clamp(talk.first().pose));
    for (int restart = 0; restart <= kMostRestarts; ++restart) {
      if (!search(start, std::min(population, kMostPopulation), random)) return;
      for (int axis = 0; axis < axes; ++axis) start[axis] = random.uniform(box_.lower[axis], box_.upper[axis]);
      population *= 2;
      if (population > kMostPopulation) return;
    }
  }

 private:
  struct Drawn {
    Vector point;       // as drawn: may lie outside the box
    double away2 = 0;   // squared distance to the box, in strides
    double merit = 0;   // of the pose in the box nearest to it
    double ranked = 0;  // the merit and what being away costs
  };

  // False when no step is left.
  bool search(const Vector& start, int population, relign::Random& random) {
    Vector stride(start.size());
    for (long axis = 0; axis < start.size(); ++axis) {  // a narrow box is searched in finer strides
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
      const bool told_apart = rank(generation, evolution.spread());
      flat = told_apart ? 0 : flat + 1;
      if (!told_apart) continue;  // an order of equals would only make the mean walk
      std::vector<Vector> ranked;
      for (const Drawn& drawn : generation) ranked.push_back(drawn.point);
      evolution.learn(ranked);
      if (!confirmed_) talk_->recommend(box_.clamp(to_pose(evolution.mean())));
    }
    return confirm(box_.clamp(to_pose(evolution.mean())));
  }

  bool measure(const cma_es::Evolution& evolution, const Vector& stride, relign::Random& random, Drawn& drawn) {
    drawn.point = evolution.draw(random);
    const relign::Pose pose = box_.clamp(to_pose(drawn.point));
    drawn.away2 = (drawn.point - to_vector(pose)).cwiseQuotient(stride).squaredNorm();
    const auto seen = talk_->step(pose);
    if (!seen) return false;
    drawn.merit = seen->merit;
    return true;
  }

  // Sorts, the best first. A merit that is no finite number is as bad as the generation's worst. False when all are
  // equally good.
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
    // The penalty is the generation's own range of merits at one spread of the draws: no unit of the merit in it. Half
    // of each, so that merits of 1e308 have a range, too.
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

  // The end of a search is looked at once: of several searches the one that ended lowest is recommended.
  bool confirm(const relign::Pose& end) {
    const auto seen = talk_->step(end);
    if (!seen) return false;
    if (std::isfinite(seen->merit) && (!confirmed_ || seen->merit < lowest_end_)) {
      lowest_end_ = seen->merit;
      confirmed_ = true;
      talk_->recommend(end);
    }
    return true;
  }

  double stride_;     // share of the travel
  double tolerance_;  // share of the travel
  int population_;    // 0: the usual one
  relign::Conversation* talk_ = nullptr;
  relign::Box box_;
  bool confirmed_ = false;  // a search has ended at lowest_end_
  double lowest_end_ = 0;
};

}  // namespace

RELIGN_PLUGIN(CmaEs)
