// Least squares without derivatives, one look at a time: steps of Levenberg-Marquardt (ceres::TinySolver) on a Jacobian
// that is differenced once and then corrected by Broyden's rank-one update after every look.
//
// The Jacobian is kept as combinations of the residuals seen, not as numbers: whoever owns the residuals may express
// them in other coordinates (blur the images less, say) and go on with the same Jacobian.
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
    // Looks at a point in the box; false when there are no more looks.
    std::function<bool(const Vector&)> look;
    // Residuals of all looks, a column each, in any coordinates that agree with each other.
    std::function<Matrix()> residuals;
  };

  // The look at `start` has been made.
  SecantSolver(Problem problem, const Vector& start)
      : problem_(std::move(problem)), combinations_(Matrix::Zero(0, start.size())) {
    remember(start);
  }

  int looks() const { return static_cast<int>(points_.size()); }
  const std::vector<Vector>& points() const { return points_; }
  int base() const { return base_; }  // the look that steps start from
  const Vector& best() const { return points_[static_cast<std::size_t>(base_)]; }
  // looks x axes: the Jacobian is residuals * combinations.
  const Matrix& combinations() const { return combinations_; }
  double last_step() const { return last_step_; }  // along its longest axis

  // One look a stride away along every axis, on the roomier side; the Jacobian is divided by the true strides. False
  // when there are no more looks.
  bool difference(const Vector& strides) {
    const int at = base_;
    for (Eigen::Index axis = 0; axis < strides.size(); ++axis) {
      Vector x = best();
      const bool up = problem_.upper[axis] - x[axis] >= x[axis] - problem_.lower[axis];
      x[axis] = std::clamp(x[axis] + (up ? strides[axis] : -strides[axis]), problem_.lower[axis], problem_.upper[axis]);
      const double stride = x[axis] - best()[axis];
      if (stride == 0) continue;  // the box has no width here
      if (!look(x)) return false;
      combinations_.col(axis).setZero();
      combinations_(looks() - 1, axis) = 1 / stride;
      combinations_(at, axis) = -1 / stride;
    }
    return true;
  }

  enum class Step { lower, not_lower, none, stopped };  // none: too short to be worth a look

  // One step from the base, which follows when the squared residuals got lower. 1 / radius is the damping as a share of
  // the Jacobian's squares.
  Step step(double radius, double shortest) {
    const int looks_before = looks(), base_before = base_;
    const Matrix shown = problem_.residuals();
    Function function{this, static_cast<int>(shown.rows()) + 1, static_cast<int>(best().size())};
    ceres::TinySolver<Function> solver;
    solver.options.max_num_iterations = 2;  // counted from 1, and the second is not begun
    solver.options.gradient_tolerance = -1;
    solver.options.function_tolerance = 0;
    solver.options.cost_threshold = -1;
    solver.options.parameter_tolerance = 1e-300;  // TinySolver's is a share of the distance from 0, which means nothing
    solver.options.initial_trust_region_radius = radius;
    shortest_ = shortest;
    Vector x = best();
    solver.Solve(function, &x);
    if (stopped_) return Step::stopped;
    if (base_ != base_before) return Step::lower;
    return looks() == looks_before ? Step::none : Step::not_lower;
  }

  // Steps and new differences until strides are shorter than `smallest` of what they were. Differences get finer where
  // they do not lead much lower any more.
  void search(const Vector& strides, double smallest) {
    const auto most_steps = 2 * strides.size();  // of one Jacobian: beyond it little of what was differenced is left
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

  // What TinySolver calls: with a Jacobian at the base, and at the candidate once it has accepted that.
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

  bool look(const Vector& x) {
    stopped_ = stopped_ || !problem_.look(x);
    if (!stopped_) remember(x);
    return !stopped_;
  }

  void remember(const Vector& x) {
    points_.push_back(x);
    Matrix longer = Matrix::Zero(looks(), x.size());
    longer.topRows(combinations_.rows()) = combinations_;
    combinations_ = longer;
  }

  // Gives the look, or -1.
  int try_step(const Vector& wanted) {
    if (!wanted.allFinite()) return -1;
    const Vector x = wanted.cwiseMax(problem_.lower).cwiseMin(problem_.upper);
    const Vector step = x - best();
    last_step_ = step.lpNorm<Eigen::Infinity>();
    if (last_step_ <= shortest_ || !look(x)) return -1;
    // Broyden: the least change of the Jacobian that explains what this step did.
    Vector change = Vector::Zero(looks());
    change[looks() - 1] = 1;
    change[base_] = -1;
    combinations_ += (change - combinations_ * step) * (step / step.squaredNorm()).transpose();
    return looks() - 1;
  }

  // An axis at its bound that would go on outwards is held.
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
