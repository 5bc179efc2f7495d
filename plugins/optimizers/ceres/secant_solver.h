// Derivative-free least squares: Levenberg-Marquardt steps (ceres::TinySolver) with a Jacobian that is differenced once
// and then corrected by Broyden's rank-one update after every evaluation.
//
// The Jacobian is stored as linear combinations of evaluated residuals, so the caller may change the coordinates of the
// residuals (for example the blur of images) and continue with the same Jacobian.
#pragma once

#include <ceres/tiny_solver.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

namespace ceres_plugin {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

class SecantSolver {
 public:
  struct Problem {
    Vector lower, upper;  // the box
    // Evaluates a point in the box; false when the budget is spent.
    std::function<bool(const Vector&)> evaluate;
    // Residuals of all evaluations, one per column, in any common coordinates.
    std::function<Matrix()> residuals;
  };

  // `start` must have been evaluated.
  SecantSolver(Problem problem, const Vector& start)
      : problem_(std::move(problem)), combinations_(Matrix::Zero(0, start.size())) {
    remember(start);
  }

  int evaluations() const { return static_cast<int>(points_.size()); }
  const std::vector<Vector>& points() const { return points_; }
  int base() const { return base_; }  // index of the evaluation that steps start from
  const Vector& best() const { return points_[static_cast<std::size_t>(base_)]; }
  // Evaluations x axes: the Jacobian is residuals * combinations.
  const Matrix& combinations() const { return combinations_; }
  double last_step() const { return last_step_; }  // largest component

  // Differences the Jacobian: one evaluation per axis, one stride towards the side with more room. Returns false when
  // the budget is spent.
  bool difference(const Vector& strides) {
    const int at = base_;
    for (Eigen::Index axis = 0; axis < strides.size(); ++axis) {
      Vector x = best();
      const bool up = problem_.upper[axis] - x[axis] >= x[axis] - problem_.lower[axis];
      x[axis] = std::clamp(x[axis] + (up ? strides[axis] : -strides[axis]), problem_.lower[axis], problem_.upper[axis]);
      const double stride = x[axis] - best()[axis];
      if (stride == 0) continue;  // the box has no width here
      if (!evaluate(x)) return false;
      combinations_.col(axis).setZero();
      combinations_(evaluations() - 1, axis) = 1 / stride;
      combinations_(at, axis) = -1 / stride;
    }
    return true;
  }

  enum class Step { lower, not_lower, none, stopped };  // none: the step is too short

  // One step from the base; the base moves if the sum of squares decreases. 1 / radius is the damping as a share of
  // J'J.
  Step step(double radius, double shortest) {
    const int evaluations_before = evaluations(), base_before = base_;
    const Matrix shown = problem_.residuals();
    Function function{this, static_cast<int>(shown.rows()) + 1, static_cast<int>(best().size())};
    ceres::TinySolver<Function> solver;
    solver.options.max_num_iterations = 2;  // counted from 1; the second iteration is not started
    solver.options.gradient_tolerance = -1;
    solver.options.function_tolerance = 0;
    solver.options.cost_threshold = -1;
    solver.options.parameter_tolerance = 1e-300;  // TinySolver's is relative to the distance from 0, meaningless here
    solver.options.initial_trust_region_radius = radius;
    shortest_ = shortest;
    Vector x = best();
    solver.Solve(function, &x);
    if (stopped_) return Step::stopped;
    if (base_ != base_before) return Step::lower;
    return evaluations() == evaluations_before ? Step::none : Step::not_lower;
  }

  // Repeats differences and steps until the strides are below `smallest` of their initial lengths. Strides are
  // shortened when a Jacobian no longer decreases the sum of squares by much.
  void search(const Vector& strides, double smallest) {
    const auto most_steps =
        2 * strides.size();  // per Jacobian: after more updates it no longer reflects the differences
    double radius = kFirstRadius;
    for (double share = 1; share >= smallest;) {
      const double before = cost();
      if (!difference(share * strides)) return;
      Eigen::Index steps = 0;
      for (int failures = 0; failures < 2 && steps < most_steps; ++steps) {
        const Step made = step(radius, 1e-3 * smallest * strides.minCoeff());
        if (made == Step::stopped) return;
        if (made == Step::none) break;
        failures = made == Step::lower ? 0 : failures + 1;
        radius = made == Step::lower ? std::min(3 * radius, 1e8) : std::max(radius / 4, 1e-4);
      }
      if (!(cost() < 0.9 * before)) share /= 4;
      radius = std::max(radius, kFirstRadius);
    }
  }

 private:
  static constexpr double kFirstRadius = 30;

  // The cost function for TinySolver, which requests a Jacobian at the base, and at a candidate after accepting it.
  struct Function {
    using Scalar = double;
    enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = Eigen::Dynamic };
    SecantSolver* self;
    int rows, axes;
    mutable int candidate = -1;
    int NumResiduals() const { return rows; }
    int NumParameters() const { return axes; }

    bool operator()(const double* x, double* residuals, double* jacobian) const {
      if (!jacobian)
        candidate = self->try_step(Eigen::Map<const Vector>(x, axes));
      else if (candidate >= 0)
        self->base_ = candidate;
      const Matrix all = self->problem_.residuals();
      Eigen::Map<Vector> out(residuals, rows);
      out.setZero();
      out.head(all.rows()) = all.col(jacobian || candidate < 0 ? self->base_ : candidate);
      if (!jacobian) return true;
      Eigen::Map<Matrix> columns(jacobian, rows, axes);
      columns.setZero();
      columns.topRows(all.rows()) = all * self->combinations_;
      self->hold_at_bounds(out, columns);
      return true;
    }
  };

  double cost() const { return problem_.residuals().col(base_).squaredNorm(); }

  bool evaluate(const Vector& x) {
    stopped_ = stopped_ || !problem_.evaluate(x);
    if (!stopped_) remember(x);
    return !stopped_;
  }

  void remember(const Vector& x) {
    points_.push_back(x);
    Matrix longer = Matrix::Zero(evaluations(), x.size());
    longer.topRows(combinations_.rows()) = combinations_;
    combinations_ = longer;
  }

  // Returns the index of the evaluation, or -1.
  int try_step(const Vector& wanted) {
    if (!wanted.allFinite()) return -1;
    const Vector x = wanted.cwiseMax(problem_.lower).cwiseMin(problem_.upper);
    const Vector step = x - best();
    last_step_ = step.lpNorm<Eigen::Infinity>();
    if (last_step_ <= shortest_ || !evaluate(x)) return -1;
    // Broyden: the smallest change of the Jacobian that reproduces this step.
    Vector change = Vector::Zero(evaluations());
    change[evaluations() - 1] = 1;
    change[base_] = -1;
    combinations_ += (change - combinations_ * step) * (step / step.squaredNorm()).transpose();
    return evaluations() - 1;
  }

  // Fixes axes at a bound whose step would lead outside.
  void hold_at_bounds(const Vector& residual, Eigen::Map<Matrix>& columns) const {
    const Vector gradient = columns.transpose() * residual;
    for (Eigen::Index axis = 0; axis < gradient.size(); ++axis)
      if ((best()[axis] <= problem_.lower[axis] && gradient[axis] > 0) ||
          (best()[axis] >= problem_.upper[axis] && gradient[axis] < 0))
        columns.col(axis).setZero();
  }

  Problem problem_;
  std::vector<Vector> points_;
  Matrix combinations_;
  int base_ = 0;
  bool stopped_ = false;
  double last_step_ = 0, shortest_ = 0;
};

}  // namespace ceres_plugin
