#include "gaussian_process.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace surrogates {

GaussianProcess::GaussianProcess(Shape shape, Matrix points, const Vector& values, const Vector& theta,
                                 const Standard& standard, const PriorAtPoints* prior)
    : kernel_(shape, theta),
      noise_(std::exp(theta[theta.size() - 1])),
      points_(std::move(points)),
      standard_(standard),
      targets_(standard.apply(values)) {
  Matrix covariance = kernel_.between(points_, points_);
  if (prior) {
    targets_ -= prior->mean;
    covariance += prior->covariance;
  }
  covariance.diagonal().array() += noise_ + kJitter;
  // Repeated poses under tiny fixed noise: increase the jitter until the factorisation succeeds.
  for (double jitter = 1e-9; !root_.compute(covariance) && jitter < 1e6; jitter *= 10)
    covariance.diagonal().array() += jitter * kernel_.amplitude();
  weights_ = root_.solve(targets_);
}

Prediction GaussianProcess::predict(const Vector& at, const PriorAt* prior) const {
  Matrix slopes;  // d x n
  Vector covariance = kernel_.between(points_, at, &slopes);
  double mean = 0;
  double variance = kernel_.amplitude();
  Vector mean_gradient = Vector::Zero(at.size());
  Vector variance_gradient = Vector::Zero(at.size());
  if (prior) {
    mean = prior->mean;
    variance += prior->variance;
    covariance += prior->covariance;
    slopes += prior->covariance_gradient;
    mean_gradient = prior->mean_gradient;
    variance_gradient = prior->variance_gradient;
  }
  const Vector solved = root_.solve(covariance);
  mean += covariance.dot(weights_);
  variance -= covariance.dot(solved);
  Prediction predicted;
  predicted.mean = standard_.mean + standard_.scale * mean;
  predicted.mean_gradient = standard_.scale * (mean_gradient + slopes * weights_);
  predicted.deviation_gradient = Vector::Zero(at.size());
  if (variance > 0) {
    predicted.deviation = standard_.scale * std::sqrt(variance);
    predicted.deviation_gradient = standard_.scale / std::sqrt(variance) * (0.5 * variance_gradient - slopes * solved);
  }
  return predicted;
}

void GaussianProcess::predict(const Matrix& at, Vector& mean, Vector& deviation, const PriorAtMany* prior) const {
  constexpr Eigen::Index kBlock = 256;  // fits into the cache
  mean.resize(at.cols());
  deviation.resize(at.cols());
  for (Eigen::Index first = 0; first < at.cols(); first += kBlock) {
    const Eigen::Index count = std::min(kBlock, at.cols() - first);
    Matrix covariance = kernel_.between(points_, at.middleCols(first, count));
    Vector means = Vector::Zero(count);
    Vector perturbations = Vector::Constant(count, kernel_.amplitude());
    if (prior) {
      covariance += prior->covariance.middleCols(first, count);
      means = prior->mean.segment(first, count);
      perturbations += prior->variance.segment(first, count);
    }
    means += covariance.transpose() * weights_;
    root_.whiten(covariance);
    perturbations -= covariance.colwise().squaredNorm().transpose();
    mean.segment(first, count) = standard_.mean + standard_.scale * means.array();
    deviation.segment(first, count) = standard_.scale * perturbations.array().max(0).sqrt();
  }
}

Vector GaussianProcess::draw(const Matrix& at, const Vector& normals) const {
  constexpr Eigen::Index kBlock = 128;
  Matrix beside = kernel_.between(points_, at);
  const Vector means = beside.transpose() * weights_;
  root_.whiten(beside);
  Matrix covariance = Matrix::Zero(at.cols(), at.cols());  // its lower triangle
  for (Eigen::Index first = 0; first < at.cols(); first += kBlock) {
    const Eigen::Index count = std::min(kBlock, at.cols() - first);
    covariance.block(first, first, at.cols() - first, count) =
        kernel_.between(at.rightCols(at.cols() - first), at.middleCols(first, count));
  }
  covariance.selfadjointView<Eigen::Lower>().rankUpdate(beside.transpose(), -1);
  covariance.diagonal().array() += noise_ + kJitter;
  Eigen::LLT<Matrix> root(covariance);
  for (double jitter = 1e-9; root.info() != Eigen::Success && jitter < 1e6; jitter *= 10) {
    covariance.diagonal().array() += jitter * kernel_.amplitude();
    root.compute(covariance);
  }
  const Vector away = root.matrixL() * normals;
  return standard_.mean + standard_.scale * (means + away).array();
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
