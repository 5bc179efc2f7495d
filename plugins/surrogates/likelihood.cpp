#include "likelihood.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "gaussian_process.hpp"

namespace surrogates {
namespace {

const double kLogTwoPi = std::log(2 * std::acos(-1.0));

}  // namespace

Likelihood::Likelihood(Shape shape, const Matrix& points, const Vector& values, Matrix fixed)
    : shape_(shape), values_(values), fixed_(std::move(fixed)) {
  squares_.reserve(static_cast<std::size_t>(points.rows()));
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    squares_.push_back(squared_differences(points.row(i), points.row(i)));
}

double Likelihood::log(const Vector& theta, Vector* gradient, double mean, double* by_mean) const {
  const Eigen::Index n = values_.size();
  const auto dimensions = static_cast<Eigen::Index>(squares_.size());
  const double amplitude = std::exp(theta[0]);
  const double noise = std::exp(theta[dimensions + 1]);
  Eigen::ArrayXXd smooth = Eigen::ArrayXXd::Zero(n, n);
  for (Eigen::Index i = 0; i < dimensions; ++i)
    smooth += std::exp(-2 * theta[i + 1]) * squares_[static_cast<std::size_t>(i)].array();
  Eigen::ArrayXXd factor;
  apply_shape(shape_, smooth, factor);
  Matrix covariance = amplitude * smooth;
  if (fixed_.size() > 0) covariance += fixed_;
  covariance.diagonal().array() += noise + kJitter;
  const Eigen::LLT<Matrix> root(covariance);
  if (gradient) gradient->setZero(theta.size());
  if (by_mean) *by_mean = 0;
  if (root.info() != Eigen::Success) return -std::numeric_limits<double>::infinity();
  const Vector centred = values_.array() - mean;
  const Vector weights = root.solve(centred);
  const double value = -0.5 * centred.dot(weights) - root.matrixLLT().diagonal().array().log().sum() -
                       0.5 * static_cast<double>(n) * kLogTwoPi;
  if (!gradient) return value;
  if (by_mean) *by_mean = weights.sum();
  // d value / d theta_j = 1/2 trace((w w^T - K^-1) dK/dtheta_j)
  const Matrix outer = weights * weights.transpose() - root.solve(Matrix::Identity(n, n));
  (*gradient)[0] = 0.5 * amplitude * (outer.array() * smooth).sum();
  const Eigen::ArrayXXd shared = outer.array() * factor;
  for (Eigen::Index i = 0; i < dimensions; ++i)
    (*gradient)[i + 1] =
        0.5 * amplitude * std::exp(-2 * theta[i + 1]) * (shared * squares_[static_cast<std::size_t>(i)].array()).sum();
  (*gradient)[dimensions + 1] = 0.5 * noise * outer.trace();
  return value;
}

ThetaBounds skopt_bounds(Eigen::Index dimensions, double fixed_noise) {
  ThetaBounds bounds{Vector::Constant(dimensions + 2, std::log(0.01)),
                     Vector::Constant(dimensions + 2, std::log(100.0))};
  bounds.upper[0] = std::log(1000.0);
  bounds.lower[dimensions + 1] = std::log(fixed_noise > 0 ? fixed_noise : 1e-5);
  bounds.upper[dimensions + 1] = std::log(fixed_noise > 0 ? fixed_noise : 1e5);
  return bounds;
}

Vector fit_theta(const Likelihood& likelihood, const ThetaBounds& bounds, const std::vector<Vector>& starts,
                 const ThetaPrior& prior) {
  const Objective objective = [&](const Vector& theta, Vector& gradient) {
    double value = likelihood.log(theta, &gradient);
    if (prior) value += prior(theta, gradient);
    gradient = -gradient;
    return -value;
  };
  Minimum best;
  for (const Vector& start : starts) {
    Minimum found = minimize(objective, start, bounds.lower, bounds.upper);
    if (best.at.size() == 0 || found.value < best.value) best = std::move(found);
  }
  return best.at;
}

}  // namespace surrogates
