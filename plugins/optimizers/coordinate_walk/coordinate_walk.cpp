// coordinate-walk: sweeps one axis after the other and stays at the best point of each sweep. See README.md.
#include <cmath>
#include <limits>
#include <relign/plugin.hpp>

namespace {

struct Sample {
  double coordinate;
  double merit;  // finite
};

// The minimum of the least-squares parabola, if it has one. Coordinates are scaled to -1 to 1 over the sweep, so that
// the normal equations are well conditioned.
std::optional<double> vertex(const std::vector<Sample>& samples, double middle, double half) {
  if (samples.size() < 3 || !(half > 0)) return std::nullopt;
  double scale = 0;  // avoids overflow of the sums
  for (const Sample& sample : samples) scale = std::max(scale, std::fabs(sample.merit));
  if (scale == 0) return std::nullopt;
  double s[5] = {};  // sums of u^k
  double t[3] = {};  // sums of u^k times merit
  for (const Sample& sample : samples) {
    const double u = (sample.coordinate - middle) / half;
    double power = 1;
    for (int k = 0; k < 5; ++k, power *= u) {
      s[k] += power;
      if (k < 3) t[k] += power * (sample.merit / scale);
    }
  }
  // Cramer's rule for y = c + b u + a u^2; the determinant is positive if at least three coordinates differ.
  const double determinant =
      s[4] * (s[2] * s[0] - s[1] * s[1]) - s[3] * (s[3] * s[0] - s[1] * s[2]) + s[2] * (s[3] * s[1] - s[2] * s[2]);
  const double a =
      t[2] * (s[2] * s[0] - s[1] * s[1]) - s[3] * (t[1] * s[0] - s[1] * t[0]) + s[2] * (t[1] * s[1] - s[2] * t[0]);
  const double b =
      s[4] * (t[1] * s[0] - t[0] * s[1]) - t[2] * (s[3] * s[0] - s[1] * s[2]) + s[2] * (s[3] * t[0] - t[1] * s[2]);
  if (!(determinant > 1e-9) || !(a > 1e-12 * determinant)) return std::nullopt;
  return middle - half * b / (2 * a);
}

class CoordinateWalk final : public relign::Optimizer {
 public:
  explicit CoordinateWalk(const relign::Parameters& given)
      : points_(static_cast<std::size_t>(given.integer("points"))),
        rounds_(static_cast<std::size_t>(given.integer("rounds"))),
        random_start_(given.text("begin") == "random"),
        parabola_(given.text("choose") == "parabola"),
        shrink_(given.number("shrink")) {
    if (points_ == 1)
      throw std::invalid_argument("parameter 'points': found '1', must be 0 (from the budget) or at least 2");
  }

  void run(relign::Trial& trial) override {
    const relign::Box box = trial.box();
    const std::size_t axes = trial.axes();
    pose_ = box.clamp(trial.first().pose);
    // A parabola needs 3 points, a choice 2; a smaller budget ends within the first sweeps.
    if (points_ == 0) points_ = std::clamp<std::size_t>(trial.budget() / (axes * rounds_), parabola_ ? 3 : 2, 1001);
    if (random_start_) {
      relign::Random random(trial.seed());
      for (std::size_t axis = 0; axis < axes; ++axis)
        pose_[axis] = place(box.lower[axis], box.upper[axis], random.below(points_));
    }
    double share = 1;  // width of a sweep, as a share of the box
    for (std::size_t round = 0; round < rounds_; ++round, share *= shrink_)
      for (std::size_t axis = 0; axis < axes; ++axis) {
        const double half = 0.5 * share * (box.upper[axis] - box.lower[axis]);
        double lower = box.lower[axis];
        double upper = box.upper[axis];
        if (share < 1) {  // centred at the pose, shifted into the box as a whole
          lower =
              std::clamp(pose_[axis] - half, box.lower[axis], std::max(box.lower[axis], box.upper[axis] - 2 * half));
          upper = std::min(lower + 2 * half, box.upper[axis]);
        }
        if (!sweep(trial, axis, lower, upper)) return;
      }
  }

 private:
  // As numpy.linspace: the last point is exactly the upper limit.
  double place(double lower, double upper, std::size_t index) const {
    if (index + 1 == points_) return upper;
    return std::min(upper, lower + static_cast<double>(index) * ((upper - lower) / static_cast<double>(points_ - 1)));
  }

  // Returns false when the trial is over. An unfinished sweep is not recommended, because it may have missed the
  // minimum.
  bool sweep(relign::Trial& trial, std::size_t axis, double lower, double upper) {
    std::vector<Sample> samples;
    relign::Pose candidate = pose_;
    for (std::size_t index = 0; index < points_; ++index) {
      candidate[axis] = place(lower, upper, index);
      const auto observation = trial.step(candidate);
      if (!observation) return false;
      if (std::isfinite(observation->merit)) samples.push_back({candidate[axis], observation->merit});
    }
    if (samples.empty()) return true;  // no usable merit: keep the pose and continue with the next axis
    const Sample* best = &samples.front();
    for (const Sample& sample : samples)
      if (sample.merit < best->merit) best = &sample;
    pose_[axis] = best->coordinate;
    if (parabola_)
      if (const auto lowest = vertex(samples, 0.5 * (lower + upper), 0.5 * (upper - lower)))
        pose_[axis] = std::clamp(*lowest, lower, upper);
    trial.recommend(pose_);
    return true;
  }

  std::size_t points_;
  std::size_t rounds_;
  bool random_start_;
  bool parabola_;
  double shrink_;
  relign::Pose pose_;  // the best coordinates so far
};

}  // namespace

RELIGN_PLUGIN(CoordinateWalk)
