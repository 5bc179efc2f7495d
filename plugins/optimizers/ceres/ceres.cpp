// ceres: Levenberg-Marquardt on the difference from the reference image, or on the merit. See README.md.
#include <relign/plugin.hpp>

#include "captures.h"
#include "least_squares/poses.hpp"
#include "local_model.h"
#include "secant_solver.h"

namespace {

using ceres_plugin::Captures;
using ceres_plugin::LocalModel;
using ceres_plugin::Matrix;
using ceres_plugin::SecantSolver;
using ceres_plugin::Vector;
using least_squares::to_pose;
using least_squares::to_vector;

constexpr double kSmallestShare = 0.02;  // of the first differences: smaller ones measure noise
constexpr double kReach = 0.06;          // share of the travel: longest step of the local model
constexpr double kLongestProbe = 0.12;   // share of the travel
constexpr int kProbesPerAxis = 20;       // then the trial ends
constexpr double kTimesProbe = 1.5;      // width of the local model's neighbourhood, in probe lengths

class Ceres final : public relign::Optimizer {
 public:
  explicit Ceres(const relign::Parameters& given)
      : by_image_(given.text("residual") == "image"),
        difference_(given.number("difference")),
        first_blur_(given.number("first_blur")),
        last_blur_(given.number("last_blur")),
        probe_(given.number("probe")) {
    if (last_blur_ > first_blur_)
      throw std::invalid_argument("parameter 'last_blur': found '" + std::to_string(last_blur_) +
                                  "', must be at most 'first_blur', " + std::to_string(first_blur_));
  }

  void run(relign::Trial& trial) override {
    const relign::Box box = trial.box();
    lower_ = to_vector(box.lower);
    upper_ = to_vector(box.upper);
    if (by_image_)
      search_by_image(trial);
    else
      search_by_merit(trial);
  }

 private:
  Vector strides() const { return Vector::Constant(lower_.size(), difference_); }

  // One residual, the merit: searches for its zero.
  void search_by_merit(relign::Trial& trial) const {
    const relign::Observation first = trial.first();
    const double unit = std::isfinite(first.merit) && first.merit > 0 ? first.merit : 1;
    std::vector<double> residuals;
    double worst = 1;
    // Negative merits count as 0, non-finite ones as the worst finite one.
    const auto take = [&](double merit) {
      const double residual = std::isfinite(merit) ? std::clamp(merit / unit, 0.0, 1e6) : worst;
      worst = std::max(worst, residual);
      residuals.push_back(residual);
    };
    take(first.merit);
    const auto evaluate = [&](const Vector& x) {
      const auto observation = trial.step(to_pose(x));
      if (observation) take(observation->merit);
      return observation.has_value();
    };
    const auto all = [&]() -> Matrix {
      return Eigen::Map<const Matrix>(residuals.data(), 1, static_cast<Eigen::Index>(residuals.size()));
    };
    SecantSolver solver({lower_, upper_, evaluate, all}, to_vector(trial.box().clamp(first.pose)));
    // Makes no recommendation: the best measured pose, which the host uses, may be one of the differences.
    solver.search(strides(), kSmallestShare);
  }

  void search_by_image(relign::Trial& trial) const {
    Captures captures(trial.reference());
    captures.set_blur(first_blur_);
    const relign::Observation first = trial.first();
    captures.add(first.image());
    const auto evaluate = [&](const Vector& x) {
      const auto observation = trial.step(to_pose(x));
      if (observation) captures.add(observation->image());
      return observation.has_value();
    };
    const auto all = [&]() -> Matrix { return ceres_plugin::coordinates(captures.products()); };
    SecantSolver solver({lower_, upper_, evaluate, all}, to_vector(trial.box().clamp(first.pose)));
    if (approach(trial, captures, solver)) refine(trial, captures, solver, evaluate);
  }

  // Coarse-to-fine steps with Broyden's Jacobian, down to last_blur. Returns false when stopped.
  bool approach(relign::Trial& trial, Captures& captures, SecantSolver& solver) const {
    if (!solver.difference(strides())) return false;
    const int most_evaluations = 2 * static_cast<int>(lower_.size());
    double blur = first_blur_, radius = 30;
    for (int failures = 0; solver.evaluations() < most_evaluations;) {
      const SecantSolver::Step made = solver.step(radius, 1e-5);
      if (made == SecantSolver::Step::stopped) return false;
      const bool lower = made == SecantSolver::Step::lower;
      if (lower) trial.recommend(to_pose(solver.best()));
      radius = lower ? std::min(radius * 3, 1e4) : radius / 4;
      failures = lower ? 0 : failures + 1;
      const bool settled =
          made == SecantSolver::Step::none || failures >= 2 || (lower && solver.last_step() < 0.3 * difference_);
      if (!settled) continue;
      if (blur <= last_blur_) return true;
      blur = std::max(last_blur_, blur / 2);
      captures.set_blur(blur);
      radius = std::max(radius, 30.0);
      failures = 0;
    }
    return true;
  }

  // Probes around the optimum of the local model, which is updated after every capture. Probes go both ways along the
  // principal directions of the Jacobian, each as far as changes the image by `probe_`.
  template <class Evaluate>
  void refine(relign::Trial& trial, Captures& captures, const SecantSolver& solver, const Evaluate& evaluate) const {
    captures.set_blur(last_blur_);
    std::vector<Vector> points = solver.points();
    Vector at = solver.best();
    const auto once = static_cast<Eigen::Index>(solver.base()), again = static_cast<Eigen::Index>(points.size());
    if (!evaluate(at)) return;
    points.push_back(at);
    const double noise = captures.noise(once, again);
    const Eigen::Index n = at.size();
    ceres_plugin::Neighbourhood near{Matrix::Identity(n, n) / (kReach * kReach), kReach, difference_};
    for (Eigen::Index k = 0; k < kProbesPerAxis * n; ++k) {
      const LocalModel model =
          fit_locally(points, captures.products(), noise, at, solver.combinations(), near, lower_, upper_);
      at = model.optimum;
      trial.recommend(to_pose(at));
      near.metric = (model.squares / (probe_ * probe_) + Matrix::Identity(n, n) / (kLongestProbe * kLongestProbe)) /
                    (kTimesProbe * kTimesProbe);
      const Eigen::Index direction = n - 1 - k / 2 % n;
      const double length = std::min(kLongestProbe, probe_ / std::sqrt(model.strength[direction] + 1e-12));
      Vector probe = at + (k % 2 == 0 ? length : -length) * model.axes.col(direction);
      if (!probe.allFinite()) probe = at;
      points.push_back(probe.cwiseMax(lower_).cwiseMin(upper_));
      if (!evaluate(points.back())) return;
    }
    at = fit_locally(points, captures.products(), noise, at, solver.combinations(), near, lower_, upper_).optimum;
    trial.recommend(to_pose(at));
  }

  bool by_image_;
  double difference_;              // share of the travel
  double first_blur_, last_blur_;  // shares of the image's side
  double probe_;                   // share of the reference's contrast
  Vector lower_, upper_;
};

}  // namespace

RELIGN_PLUGIN(Ceres)
