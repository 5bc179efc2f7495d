// Joint least-squares fit of start, distortion and element state to all captures: residuals in standard deviations of
// the noise, parameters in standard deviations of the level's draws. Solved by ceres::TinySolver.
#pragma once

#include <ceres/tiny_solver.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "derivatives.hpp"
#include "least_squares/nuisance.hpp"

namespace tolerance_fit {

// All captures at one commanded pose.
struct Site {
  Vector commanded;  // relative to the start
  std::uint64_t limits_low = 0, limits_high = 0;
  int count = 0;
  std::vector<double> sum;  // pixels of all captures, added
  Vector mean(Size size, Detail detail) const { return binned(sum, size, detail) / count; }
};

// The parameter vector: start, entries of the distortion, state. Each has mean 0 and variance 1 in the level's draws.
class Layout {
 public:
  explicit Layout(const Knowledge& known)
      : level_(known.level), axes_(known.axes()), states_(known.combinations.cols()) {
    constexpr Eigen::Index kMaxAxes = 12;  // with more, the coupling of axes, axes^2 parameters, is not fitted
    for (Eigen::Index row = 0; row < axes_; ++row)
      for (Eigen::Index column = 0; column < axes_; ++column)
        if (level_.distortion_std(row, column) > 0 && (row == column || axes_ <= kMaxAxes))
          entries_.emplace_back(row, column);
  }

  Eigen::Index axes() const { return axes_; }
  Eigen::Index size() const { return axes_ + entries() + states_; }
  Vector start(const Vector& x) const { return level_.start_mean + level_.start_std.cwiseProduct(x.head(axes_)); }
  Vector state(const Vector& x) const { return x.tail(states_); }
  Matrix distortion(const Vector& x) const {
    Matrix distortion = level_.distortion_mean;
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      const auto [row, column] = entries_[i];
      distortion(row, column) += level_.distortion_std(row, column) * x[axes_ + static_cast<Eigen::Index>(i)];
    }
    return distortion;
  }
  // Not clamped to the travel: limits are treated by JointFit.
  Vector pose(const Vector& x, const Vector& commanded) const { return start(x) + distortion(x) * commanded; }
  Vector commanded(const Vector& x, const Vector& pose) const {
    return distortion(x).partialPivLu().solve(pose - start(x));
  }
  void set_start(Vector& x, const Vector& start) const {
    for (Eigen::Index i = 0; i < axes_; ++i)
      x[i] = level_.start_std[i] > 0 ? (start[i] - level_.start_mean[i]) / level_.start_std[i] : 0;
  }

  // d (pose, state) / d x
  Matrix chain(const Vector& commanded) const {
    Matrix chain = Matrix::Zero(axes_ + states_, size());
    chain.topLeftCorner(axes_, axes_).diagonal() = level_.start_std;
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      const auto [row, column] = entries_[i];
      chain(row, axes_ + static_cast<Eigen::Index>(i)) = level_.distortion_std(row, column) * commanded[column];
    }
    chain.bottomRightCorner(states_, states_).setIdentity();
    return chain;
  }

 private:
  Eigen::Index entries() const { return static_cast<Eigen::Index>(entries_.size()); }
  const Level& level_;
  Eigen::Index axes_, states_;
  std::vector<std::pair<Eigen::Index, Eigen::Index>> entries_;
};

class JointFit {
 public:
  // stray: light in captures that the model lacks, in the derivatives' detail. Its strength, gain, offset and smooth
  // stray light are fitted along, unless it is empty.
  JointFit(const Knowledge& known, const Layout& layout, Derivatives& derivatives, Size size, const Vector& stray,
           const std::vector<const Site*>& sites, const Vector& x)
      : known_(known), layout_(layout), derivatives_(derivatives), stray_(stray) {
    const Detail detail = derivatives.detail();
    // Errors of the linear model are correlated over the area of the blur (as in `sensitivity`).
    const double noise = 1 + 4 * kPi * detail.blur * detail.blur;
    const least_squares::Nuisance<double>::Size bins{static_cast<Eigen::Index>(size.width / detail.bin),
                                                     static_cast<Eigen::Index>(size.height / detail.bin)};
    for (const Site* site : sites) {
      Fitted fitted{site, site->mean(size, detail), {}, {}, layout.chain(site->commanded), {}, {}};
      const Vector picture = look(*site, x), variance = known.variance(picture, detail);
      const int renders = derivatives.around(layout.pose(x, site->commanded), layout.state(x)).renders;
      const double share = 1.0 / site->count + detail.noise / renders;
      fitted.weight = (share * variance).cwiseSqrt().cwiseInverse();
      if (stray.size() > 0) fitted.nuisance = {picture, stray, bins, noise, fitted.weight};
      fitted_.push_back(std::move(fitted));
    }
  }

  // Returns half the sum of squares.
  double solve(Vector& x, int steps, double damping) {
    Function function{this};
    ceres::TinySolver<Function> solver;
    solver.options.max_num_iterations = steps + 1;  // counted from 1
    solver.options.gradient_tolerance = 1e-6;
    solver.options.function_tolerance = 0.05;  // relative to the sum of squares, in units of the noise variance
    solver.options.parameter_tolerance = 1e-4;
    solver.options.initial_trust_region_radius = 1 / damping;
    solver.Solve(function, &x);
    return solver.summary.final_cost;
  }

  // Mean squared difference between the captures of a site and the fit; 1 if it is noise alone.
  double misfit(std::size_t site, const Vector& x) {
    const Fitted& fitted = fitted_[site];
    const Vector picture = look(*fitted.site, x);
    const Vector residual = (fitted.mean - picture).cwiseProduct(fitted.weight);
    const auto fit = fitted.nuisance.fit(residual);
    // The variance of photon noise is proportional to the gain, that of an amplified image to its square.
    const double expected =
        known_.expected_misfit(picture, derivatives_.detail()) * std::pow(std::clamp(fit.gain, 0.5, 2.0), 1.5);
    const double left = residual.squaredNorm() - fit.explained;
    return left / static_cast<double>(residual.size()) / std::max(expected, 1e-6);
  }

 private:
  static constexpr double kPi = 3.14159265358979323846;
  static constexpr double kLimit = 0.003;  // standard deviation of a pose at a limit, share of the travel

  struct Fitted {
    const Site* site;
    Vector mean, weight;
    least_squares::Nuisance<double> nuisance;  // of weighted residuals
    Matrix chain;
    Matrix axes;    // bins x (pose, state): orthonormal basis of the derivatives at the last accepted x
    Matrix slopes;  // derivatives in that basis
  };

  struct Function {
    using Scalar = double;
    enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = Eigen::Dynamic };
    JointFit* self;
    int NumResiduals() const { return static_cast<int>(self->rows()); }
    int NumParameters() const { return static_cast<int>(self->layout_.size()); }
    bool operator()(const double* x, double* residuals, double* jacobian) const {
      self->evaluate(Eigen::Map<const Vector>(x, NumParameters()), residuals, jacobian);
      return true;
    }
  };

  // Rows per site: one for each of pose and state, one for the rest of the residual, one limit per axis.
  Eigen::Index rows_of_site() const { return fitted_.front().chain.rows() + 1 + layout_.axes(); }
  Eigen::Index rows() const { return static_cast<Eigen::Index>(fitted_.size()) * rows_of_site() + layout_.size(); }

  // The expected capture.
  Vector look(const Site& site, const Vector& x) const {
    Vector picture = derivatives_.look(layout_.pose(x, site.commanded), layout_.state(x));
    if (stray_.size() > 0) picture += stray_;
    return picture;
  }
  Vector residual_of(const Fitted& fitted, const Vector& x) const {
    return fitted.nuisance.whitened((look(*fitted.site, x) - fitted.mean).cwiseProduct(fitted.weight));
  }

  // Projects thousands of residuals on the column space of the Jacobian, which leaves the normal equations unchanged.
  static void set_axes(Fitted& fitted, const Matrix& derivatives) {
    Matrix columns = fitted.weight.asDiagonal() * derivatives;
    for (Eigen::Index i = 0; i < columns.cols(); ++i) columns.col(i) = fitted.nuisance.whitened(columns.col(i));
    const Eigen::SelfAdjointEigenSolver<Matrix> solver(columns.transpose() * columns);
    const Vector lengths = solver.eigenvalues().cwiseMax(0).cwiseSqrt();
    const double smallest = 1e-6 * lengths.maxCoeff() + 1e-12;
    const Vector inverse = lengths.unaryExpr([&](double length) { return length > smallest ? 1 / length : 0.0; });
    fitted.axes = columns * solver.eigenvectors() * inverse.asDiagonal();
    fitted.slopes = lengths.asDiagonal() * solver.eigenvectors().transpose();
  }

  void evaluate(const Vector& x, double* residuals, double* jacobian) {
    Eigen::Map<Vector> out(residuals, rows());
    out.setZero();
    Matrix slopes = Matrix::Zero(rows(), layout_.size());
    Eigen::Index row = 0;
    for (Fitted& fitted : fitted_) {
      const Vector pose = layout_.pose(x, fitted.site->commanded);
      const Eigen::Index d = fitted.chain.rows();
      if (jacobian) set_axes(fitted, derivatives_.around(pose, layout_.state(x)).slopes);
      const Vector residual = residual_of(fitted, x);
      out.segment(row, d) = fitted.axes.transpose() * residual;
      Matrix chain = fitted.chain;
      for (Eigen::Index axis = 0; axis < layout_.axes(); ++axis)
        if (pose[axis] < 0 || pose[axis] > 1) chain.row(axis).setZero();
      slopes.middleRows(row, d) = fitted.slopes * chain;
      if (derivatives_.detail().captures > 0)
        out[row + d] = std::sqrt(std::max(residual.squaredNorm() - out.segment(row, d).squaredNorm(), 0.0));
      row += d + 1;
      for (Eigen::Index axis = 0; axis < layout_.axes(); ++axis, ++row) {
        const double beyond = beyond_the_limits(*fitted.site, pose, axis);
        if (beyond == 0) continue;
        out[row] = beyond / kLimit;
        slopes.row(row) = fitted.chain.row(axis) / kLimit;
      }
    }
    out.tail(layout_.size()) = x;
    slopes.bottomRows(layout_.size()).setIdentity();
    if (jacobian) Eigen::Map<Matrix>(jacobian, rows(), layout_.size()) = slopes;
  }

  // Distance by which a pose contradicts the limit switches: a move that hit no limit ended within the travel, one that
  // hit a limit would have ended at it or beyond.
  static double beyond_the_limits(const Site& site, const Vector& pose, Eigen::Index axis) {
    const std::uint64_t bit = std::uint64_t{1} << axis;
    double beyond = 0;
    if (site.limits_low & bit)
      beyond = std::max(pose[axis], 0.0);
    else if (pose[axis] < 0)
      beyond = pose[axis];
    if (site.limits_high & bit)
      beyond = std::min(pose[axis] - 1, 0.0);
    else if (pose[axis] > 1)
      beyond = pose[axis] - 1;
    return beyond;
  }

  const Knowledge& known_;
  const Layout& layout_;
  Derivatives& derivatives_;
  Vector stray_;
  std::vector<Fitted> fitted_;
};

}  // namespace tolerance_fit
