// A quadratic model of the residuals around a pose, fitted to all captures near it, and its optimum. Unlike Broyden's
// update, the fit averages out noise.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "secant_solver.h"

namespace ceres_plugin {

struct LocalModel {
  Vector optimum;   // inside the box
  Matrix squares;   // J'J, corrected for noise
  Matrix axes;      // its eigenvectors as columns, the least sensitive direction first
  Vector strength;  // its eigenvalues: squared change of the image per unit
};

struct Neighbourhood {
  Matrix metric;      // weight of a capture at displacement d: exp(-d' metric d / 2)
  double reach = 0;   // longest step
  double stride = 0;  // length of the differences behind the prior Jacobian, which determines its weight
};

// Basis of the model: 1, the displacement, and all quadratic terms, the latter in units of the metric and scaled so
// that a ridge penalty is invariant to rotations.
inline Vector quadratic_terms(const Vector& away, const Matrix& root_of_metric) {
  const Eigen::Index n = away.size();
  const Vector far = root_of_metric * away;
  Vector terms(1 + n + n * (n + 1) / 2);
  terms[0] = 1;
  terms.segment(1, n) = away;
  Eigen::Index next = n + 1;
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = i; j < n; ++j) terms[next++] = far[i] * far[j] * (i == j ? 1 : std::sqrt(2.0));
  return terms;
}

// products: inner products of all captures. noise: its contribution to the product of a capture with itself, which is
// subtracted; otherwise steps along insensitive directions would follow the noise of the differences. prior: a Jacobian
// as combinations of the first captures.
inline LocalModel fit_locally(const std::vector<Vector>& points, const Matrix& products, double noise, const Vector& at,
                              const Matrix& prior, const Neighbourhood& near, const Vector& lower,
                              const Vector& upper) {
  // Damping shortens steps along insensitive directions; 0.01 of J'J would be too much. The noise term of J'J is known
  // except for a small share, which damps the directions below it. A ridge with the weight of one capture keeps the
  // curvature small, which would otherwise fit the noise of few captures.
  constexpr double kPriorWeight = 0.06, kDamping = 0.001, kNoiseShare = 0.02, kRidge = 1;
  const auto count = static_cast<Eigen::Index>(points.size());
  const Eigen::Index n = at.size();
  const Matrix root = Eigen::LLT<Matrix>(near.metric).matrixU();
  Matrix design(count, quadratic_terms(at, root).size());
  Vector weights(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Vector away = points[static_cast<std::size_t>(k)] - at;
    design.row(k) = quadratic_terms(away, root).transpose();
    weights[k] = std::exp(-0.5 * away.dot(near.metric * away));
  }
  const double trust = kPriorWeight * near.stride * near.stride;
  Matrix normal = design.transpose() * weights.asDiagonal() * design;
  Matrix right = design.transpose() * Matrix(weights.asDiagonal());
  for (Eigen::Index axis = 0; axis < n; ++axis) {
    normal(axis + 1, axis + 1) += trust;
    right.row(axis + 1).head(prior.rows()) += trust * prior.col(axis).transpose();
  }
  normal.diagonal().tail(normal.rows() - n - 1).array() += kRidge;
  // Rows: residual, Jacobian and curvature at `at`, as combinations of captures.
  const Matrix fitted = normal.ldlt().solve(right);
  Matrix clean = products;
  clean.diagonal().array() -= noise;
  const Matrix jacobian = fitted.middleRows(1, n);
  const Vector gradient = jacobian * clean * fitted.row(0).transpose();

  LocalModel model;
  model.squares = jacobian * clean * jacobian.transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(model.squares);
  model.axes = eigen.eigenvectors();
  model.strength = eigen.eigenvalues().cwiseMax(0.0);
  model.squares = model.axes * model.strength.asDiagonal() * model.axes.transpose();
  Matrix damped = model.squares;
  for (Eigen::Index axis = 0; axis < n; ++axis)
    damped(axis, axis) += kDamping * std::max(model.squares(axis, axis), 1e-3 * model.strength.maxCoeff());
  damped += kNoiseShare * noise * jacobian * jacobian.transpose();
  Vector step = -damped.ldlt().solve(gradient);
  if (!step.allFinite()) step.setZero();
  step = (at + step).cwiseMax(lower).cwiseMin(upper) - at;
  if (step.norm() > near.reach) step *= near.reach / step.norm();
  model.optimum = (at + step).cwiseMax(lower).cwiseMin(upper);
  return model;
}

}  // namespace ceres_plugin
