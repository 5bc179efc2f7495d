#include "target_model.hpp"

#include <cmath>

#include "surrogates/gaussian_process.hpp"

namespace transfer_gp {
namespace {

void append_columns(Matrix& matrix, const Matrix& more) {
  matrix.conservativeResize(more.rows(), matrix.cols() + more.cols());
  matrix.rightCols(more.cols()) = more;
}

}  // namespace

Candidates make_candidates(const SourceModel& sources, const Matrix& points) {
  const Known known = sources.know(points);
  return {points,
          known.mean,
          sources.variance(known),
          known.white.cast<float>(),
          known.excess.cast<float>(),
          Matrix(0, points.cols())};
}

void keep_first(Candidates& candidates, Eigen::Index count) {
  if (candidates.points.cols() <= count) return;
  const auto cut = [count](auto& matrix) { matrix.conservativeResize(matrix.rows(), count); };
  cut(candidates.points);
  cut(candidates.white);
  cut(candidates.excess);
  cut(candidates.covariance);
  candidates.mean.conservativeResize(count);
  candidates.variance.conservativeResize(count);
}

void TargetModel::add(const Vector& point, double value, Candidates& candidates) {
  const Eigen::Index n = size();
  const Known now = sources_->know(point);
  Matrix grown(n + 1, n + 1);
  if (n > 0) {
    const Vector beside = sources_->covariance(known_, now);
    grown.topLeftCorner(n, n) = covariance_;
    grown.topRightCorner(n, 1) = beside;
    grown.bottomLeftCorner(1, n) = beside.transpose();
  }
  grown(n, n) = sources_->variance(now)[0];
  covariance_ = std::move(grown);

  append_columns(known_.points, now.points);
  append_columns(known_.white, now.white);
  append_columns(known_.excess, now.excess);
  known_.mean.conservativeResize(n + 1);
  known_.mean[n] = now.mean[0];
  values_.conservativeResize(n + 1);
  values_[n] = value;

  Matrix row = sources_->prior(point, candidates.points);
  if (candidates.white.rows() > 0)
    row -= (candidates.white.transpose() * now.white.cast<float>()).transpose().cast<double>();
  if (candidates.excess.rows() > 0)
    row += (candidates.excess.transpose() * now.excess.cast<float>()).transpose().cast<double>();
  candidates.covariance.conservativeResize(n + 1, candidates.points.cols());
  candidates.covariance.bottomRows(1) = row;
}

Matrix TargetModel::fixed_covariance() const {
  return sources_->stacking() == Stacking::exact && sources_->size() > 0 ? covariance_ : Matrix();
}

void TargetModel::set_values(const Vector& values) {
  values_ = values;
  if (root_.size() == size()) weights_ = root_.solve(residual());
}

void TargetModel::set_theta(const Vector& theta) {
  theta_ = theta;
  kernel_ = surrogates::Kernel(sources_->shape(), theta);
  Matrix matrix = kernel_.between(points(), points());
  if (sources_->stacking() == Stacking::exact) matrix += covariance_;
  matrix.diagonal().array() += std::exp(theta[theta.size() - 1]) + surrogates::kJitter;
  // Repeated poses under tiny noise: increase the jitter until the factorisation succeeds.
  for (double jitter = 1e-9; !root_.compute(matrix) && jitter < 1e6; jitter *= 10)
    matrix.diagonal().array() += jitter * kernel_.amplitude();
  weights_ = root_.solve(residual());
}

void TargetModel::extend() {
  const Eigen::Index n = root_.size();
  const bool exact = sources_->stacking() == Stacking::exact;
  Vector beside = kernel_.between(points().leftCols(n), Matrix(points().rightCols(1)));
  if (exact) beside += covariance_.col(n).head(n);
  const double corner =
      kernel_.amplitude() + (exact ? covariance_(n, n) : 0) + std::exp(theta_[theta_.size() - 1]) + surrogates::kJitter;
  if (n + 1 != size() || !root_.append(beside, corner)) return set_theta(Vector(theta_));
  weights_ = root_.solve(residual());
}

Predictions TargetModel::predict(const Candidates& candidates) const {
  return predict(candidates.points, candidates.mean, candidates.variance, candidates.covariance);
}

Predictions TargetModel::predict(const Matrix& at) const {
  const Known there = sources_->know(at);
  return predict(at, there.mean, sources_->variance(there), sources_->covariance(known_, there));
}

Predictions TargetModel::predict(const Matrix& at, const Vector& mean, const Vector& variance,
                                 const Matrix& covariance) const {
  Matrix own = kernel_.between(points(), at);
  Predictions predicted;
  Vector left = Vector::Constant(at.cols(), kernel_.amplitude()) + variance;
  if (sources_->stacking() == Stacking::exact) own += covariance;
  predicted.mean = mean + own.transpose() * weights_;
  root_.whiten(own);
  left -= own.colwise().squaredNorm().transpose();
  if (sources_->stacking() == Stacking::boosted) {
    // The sources' error h contributes h(x) - A h(X) with A = k(x, X) (K + noise)^-1.
    Matrix passed = own;  // becomes A^T
    root_.unwhiten(passed);
    left -= 2 * passed.cwiseProduct(covariance).colwise().sum().transpose();
    left += passed.cwiseProduct(covariance_ * passed).colwise().sum().transpose();
  }
  predicted.deviation = left.cwiseMax(0).cwiseSqrt();
  return predicted;
}

Vector TargetModel::mean(const Matrix& at) const {
  const Vector own = kernel_.between(points(), at).transpose() * weights_;
  if (sources_->stacking() != Stacking::exact || sources_->size() == 0) return sources_->mean(at) + own;
  return sources_->mean_less(at, known_.white * weights_) + sources_->prior(at, points()) * weights_ + own;
}

}  // namespace transfer_gp
