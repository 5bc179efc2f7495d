// A quadratic model of the residuals around a pose, fitted to every capture near it at once, and the pose that it
// thinks best. Where Broyden's update learns from a step what it can, this averages noise away.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "secant_solver.h"

namespace ceres_plugin {

struct LocalModel {
  Vector optimum;   // in the box
  Matrix squares;   // J'J without what noise adds to it
  Matrix axes;      // its principal directions, columns; the one the image feels least comes first
  Vector strength;  // squared change of the image per unit along each
};

struct Neighbourhood {
  Matrix metric;      // a capture's weight is exp(-d' metric d / 2)
  double reach = 0;   // longest step
  double stride = 0;  // what the prior Jacobian is worth: differences of this length
};

// 1, the way from the pose, and all products of two ways, these in units of the metric and so that turning the axes
// makes no difference to a ridge over them.
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

// products: of all captures with each other. noise: what it adds to those of a capture with itself, and so, squared
// weights being what they are, to J'J: without that correction steps along directions that the image hardly feels would
// follow the noise of the differences. prior: Jacobian as combinations of the first captures.
inline LocalModel fit_locally(const std::vector<Vector>& points, const Matrix& products, double noise, const Vector& at,
                              const Matrix& prior, const Neighbourhood& near, const Vector& lower,
                              const Vector& upper) {
  // Damping shortens every step along what is hardly felt: as a share of J'J a hundredth is too much. What noise added
  // to J'J is known but for a small share, which damps what is felt less than that. Curvature is held small by a ridge
  // as heavy as one capture, or else it would take up the noise of few captures.
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
  // Residual at `at`, its Jacobian there and its curvature, as combinations of captures.
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
