#include "gaussian_process.hpp"

#include <algorithm>
#include <cmath>

namespace surrogates {

GaussianProcess::GaussianProcess(Shape shape, Matrix points, const Vector& values, const Vector& theta,
                                 const Standard& standard, const KnownAtPoints* known)
    : kernel_(shape, theta),
      noise_(std::exp(theta[theta.size() - 1])),
      points_(std::move(points)),
      standard_(standard),
      targets_(standard.apply(values)) {
  Matrix covariance = kernel_.between(points_, points_);
  if (known) {
    targets_ -= known->mean;
    covariance += known->covariance;
  }
  covariance.diagonal().array() += noise_ + kJitter;
  // Poses that repeat under a tiny fixed noise: as much jitter as it takes.
  for (double jitter = 1e-9; !root_.compute(covariance) && jitter < 1e6; jitter *= 10)
    covariance.diagonal().array() += jitter * kernel_.amplitude();
  weights_ = root_.solve(targets_);
}

Prediction GaussianProcess::predict(const Vector& at, const KnownAt* known) const {
  Matrix slopes;  // d x n
  Vector covariance = kernel_.between(points_, at, &slopes);
  double mean = 0;
  double variance = kernel_.amplitude();
  Vector mean_gradient = Vector::Zero(at.size());
  Vector variance_gradient = Vector::Zero(at.size());
  if (known) {
    mean = known->mean;
    variance += known->variance;
    covariance += known->covariance;
    slopes += known->covariance_gradient;
    mean_gradient = known->mean_gradient;
    variance_gradient = known->variance_gradient;
  }
  const Vector solved = root_.solve(covariance);
  mean += covariance.dot(weights_);
  variance -= covariance.dot(solved);
  Prediction told;
  told.mean = standard_.mean + standard_.scale * mean;
  told.mean_gradient = standard_.scale * (mean_gradient + slopes * weights_);
  told.deviation_gradient = Vector::Zero(at.size());
  if (variance > 0) {
    told.deviation = standard_.scale * std::sqrt(variance);
    told.deviation_gradient = standard_.scale / std::sqrt(variance) * (0.5 * variance_gradient - slopes * solved);
  }
  return told;
}

void GaussianProcess::predict(const Matrix& at, Vector& mean, Vector& deviation, const KnownAtMany* known) const {
  constexpr Eigen::Index kBlock = 256;  // small enough for the cache
  mean.resize(at.cols());
  deviation.resize(at.cols());
  for (Eigen::Index first = 0; first < at.cols(); first += kBlock) {
    const Eigen::Index count = std::min(kBlock, at.cols() - first);
    Matrix covariance = kernel_.between(points_, at.middleCols(first, count));
    Vector means = Vector::Zero(count);
    Vector variances = Vector::Constant(count, kernel_.amplitude());
    if (known) {
      covariance += known->covariance.middleCols(first, count);
      means = known->mean.segment(first, count);
      variances += known->variance.segment(first, count);
    }
    means += covariance.transpose() * weights_;
    root_.whiten(covariance);
    variances -= covariance.colwise().squaredNorm().transpose();
    mean.segment(first, count) = standard_.mean + standard_.scale * means.array();
    deviation.segment(first, count) = standard_.scale * variances.array().max(0).sqrt();
  }
}

bool GaussianProcess::append(const Vector& at, double value) {
  if (!root_.append(kernel_.between(points_, at, nullptr), kernel_.amplitude() + noise_ + kJitter)) return false;
  points_.conservativeResize(Eigen::NoChange, points_.cols() + 1);
  points_.rightCols(1) = at;
  targets_.conservativeResize(targets_.size() + 1);
  targets_[targets_.size() - 1] = (value - standard_.mean) / standard_.scale;
  weights_ = root_.solve(targets_);
  return true;
}

}  // namespace surrogates
