// scan: a full grid over the box, coarse points first. See README.md.
#include <cmath>
#include <limits>
#include <relign/plugin.hpp>

namespace {

constexpr std::size_t most_points = 1001;  // per axis; also the maximum in the manifest

// The largest n <= most_points with n^axes <= budget, at least 1. Uses integers: a floating-point root gives 4 for 125
// steps and 3 axes.
std::size_t points_for(unsigned budget, std::size_t axes) {
  const auto fits = [&](std::size_t points) {
    double grid = 1;  // exact up to 2^53, and a budget has 32 bits
    for (std::size_t axis = 0; axis < axes && grid <= budget; ++axis) grid *= static_cast<double>(points);
    return grid <= budget;
  };
  std::size_t points = 1;
  while (points < most_points && fits(points + 1)) ++points;
  return points;
}

// The indices of one axis in visiting order; level l consists of the first ends[l] of them.
struct Ladder {
  std::vector<std::size_t> order;
  std::vector<std::size_t> ends;
};

Ladder rows(std::size_t points) {
  Ladder ladder;
  for (std::size_t index = 0; index < points; ++index) ladder.order.push_back(index);
  ladder.ends = {points};
  return ladder;
}

// The middle, the ends, then repeatedly the middles of the gaps.
Ladder coarse_first(std::size_t points) {
  Ladder ladder;
  std::vector<bool> taken(points, false);
  const auto take = [&](std::size_t index) {
    if (!taken[index]) ladder.order.push_back(index);
    taken[index] = true;
  };
  take((points - 1) / 2);
  ladder.ends = {1};
  take(0);
  take(points - 1);
  while (ladder.order.size() > ladder.ends.back()) {
    ladder.ends.push_back(ladder.order.size());
    const std::vector<bool> before = taken;
    std::size_t left = 0;  // index 0 is already taken
    for (std::size_t index = 1; index < points; ++index) {
      if (!before[index]) continue;
      take((left + index) / 2);  // no effect for neighbours
      left = index;
    }
  }
  return ladder;
}

class Scan final : public relign::Optimizer {
 public:
  explicit Scan(const relign::Parameters& given)
      : points_(static_cast<std::size_t>(given.integer("points"))),
        coarse_first_(given.text("order") == "coarse-first"),
        ends_(given.text("placement") == "ends"),
        start_counts_(given.boolean("start_counts")) {}

  void run(relign::Trial& trial) override {
    box_ = trial.box();
    const relign::Observation first = trial.first();
    if (start_counts_ && box_.clamp(first.pose) == first.pose) take(trial, first);
    if (points_ == 0) points_ = points_for(trial.budget(), trial.axes());
    const Ladder ladder = coarse_first_ ? coarse_first(points_) : rows(points_);
    for (std::size_t level = 0; level < ladder.ends.size(); ++level)
      if (!visit(trial, ladder, level)) return;
  }

 private:
  // Visits the points of a level that were not part of the previous level. Returns false when the trial is over. Every
  // point that is skipped was a step before, so skipping never dominates the time of a trial.
  bool visit(relign::Trial& trial, const Ladder& ladder, std::size_t level) {
    const std::size_t known = level == 0 ? 0 : ladder.ends[level - 1];
    std::vector<std::size_t> places(trial.axes(), 0);  // index into ladder.order per axis
    relign::Pose pose(trial.axes());
    while (true) {
      bool fresh = false;
      for (const std::size_t place : places) fresh = fresh || place >= known;
      if (fresh) {
        for (std::size_t axis = 0; axis < pose.size(); ++axis)
          pose[axis] = coordinate(axis, ladder.order[places[axis]]);
        const auto observation = trial.step(pose);
        if (!observation) return false;
        take(trial, *observation);
      }
      std::size_t axis = places.size();  // next point, the last axis fastest
      while (axis > 0 && ++places[axis - 1] == ladder.ends[level]) places[--axis] = 0;
      if (axis == 0) return true;
    }
  }

  double coordinate(std::size_t axis, std::size_t index) const {
    const double lower = box_.lower[axis];
    const double upper = box_.upper[axis];
    if (!ends_)
      return std::clamp(lower + (upper - lower) * (static_cast<double>(index) + 0.5) / static_cast<double>(points_),
                        lower, upper);
    if (points_ == 1) return lower;  // as numpy.linspace
    if (index == points_ - 1) return upper;
    return lower + static_cast<double>(index) * ((upper - lower) / static_cast<double>(points_ - 1));
  }

  // Recommends the pose if its merit is finite and lower than all before.
  void take(relign::Trial& trial, const relign::Observation& observation) {
    if (!std::isfinite(observation.merit) || observation.merit >= best_merit_) return;
    best_merit_ = observation.merit;
    trial.recommend(observation.pose);
  }

  std::size_t points_;
  bool coarse_first_;
  bool ends_;
  bool start_counts_;
  relign::Box box_;
  double best_merit_ = std::numeric_limits<double>::infinity();
};

}  // namespace

RELIGN_PLUGIN(Scan)
