#include "source_model.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "surrogates/gaussian_process.hpp"

namespace transfer_gp {
namespace {

constexpr Eigen::Index kBlock = 256;  // columns at a time, to fit into the cache

template <class Right>
void solve_lower(const Matrix& root, Right&& right) {
  root.triangularView<Eigen::Lower>().solveInPlace(right);
}

template <class Right>
void solve_transposed(const Matrix& root, Right&& right) {
  root.transpose().triangularView<Eigen::Upper>().solveInPlace(right);
}

// Lower Cholesky factor; false if the matrix is not positive definite.
bool factor(Matrix matrix, Matrix& root) {
  const Eigen::LLT<Matrix> done(matrix);
  root = done.matrixL();
  return done.info() == Eigen::Success && root.diagonal().allFinite();
}

}  // namespace

bool SourceModel::append(const Matrix& points, const Vector& values, const Vector& theta) {
  const Eigen::Index before = size(), count = values.size(), all = before + count;
  const surrogates::Kernel kernel(shape_, theta);
  const double noise = std::exp(theta[theta.size() - 1]) + surrogates::kJitter;
  Level level{before, count, kernel, {}, {}};
  Matrix own = kernel.between(points, points);
  if (stacking_ != Stacking::exact) {
    Matrix noisy = own;
    noisy.diagonal().array() += noise;
    if (!factor(std::move(noisy), level.own_root)) return false;
    level.own_weights = values - mean(points);
    solve_lower(level.own_root, level.own_weights);
    solve_transposed(level.own_root, level.own_weights);
  }
  if (stacking_ != Stacking::means) {
    // Appends rows to the joint factor; the Schur complement of the new block is its posterior covariance.
    Matrix beside = cross(points);
    if (before > 0) solve_lower(root_, beside);
    Matrix corner = prior(points, points) + own - beside.transpose() * beside;
    corner.diagonal().array() += noise;
    Matrix corner_root;
    if (!factor(std::move(corner), corner_root)) return false;
    Matrix root = Matrix::Zero(all, all);
    root.topLeftCorner(before, before) = root_;
    root.bottomLeftCorner(count, before) = beside.transpose();
    root.bottomRightCorner(count, count) = corner_root;
    root_ = std::move(root);
  }
  points_.conservativeResize(points.rows(), all);
  points_.rightCols(count) = points;
  values_.conservativeResize(all);
  values_.tail(count) = values;
  levels_.push_back(std::move(level));
  if (stacking_ != Stacking::means) {
    amplitude_ += kernel.amplitude();
    whitened_ = values_;
    solve_lower(root_, whitened_);
    weights_ = whitened_;
    solve_transposed(root_, weights_);
  }
  return true;
}

Matrix SourceModel::cross(const Matrix& points) const {
  Matrix sum = Matrix::Zero(size(), points.cols());
  // Level l contributes to all sources from l on.
  for (const Level& level : levels_)
    sum.bottomRows(size() - level.first) += level.kernel.between(points_.rightCols(size() - level.first), points);
  return sum;
}

Matrix SourceModel::prior(const Matrix& a, const Matrix& b) const {
  Matrix sum = Matrix::Zero(a.cols(), b.cols());
  if (stacking_ == Stacking::means) return sum;
  for (const Level& level : levels_) sum += level.kernel.between(a, b);
  return sum;
}

Vector SourceModel::mean(const Matrix& points) const {
  Vector sum = Vector::Zero(points.cols());
  if (size() == 0) return sum;
  if (stacking_ == Stacking::exact) return cross(points).transpose() * weights_;
  for (const Level& level : levels_)
    sum += level.kernel.between(points_.middleCols(level.first, level.count), points).transpose() * level.own_weights;
  return sum;
}

Vector SourceModel::mean_less(const Matrix& points, const Vector& white_weights) const {
  Vector weights = white_weights;
  solve_transposed(root_, weights);
  return cross(points).transpose() * (weights_ - weights);
}

// Mean = sum over levels of k_j(x, X_j) K_j^-1 (y_j - means of the previous levels at X_j), as a linear function of y.
Matrix SourceModel::stacked_weights(const Matrix& points) const {
  Matrix weights = Matrix::Zero(size(), points.cols());
  for (auto level = levels_.rbegin(); level != levels_.rend(); ++level) {
    const Matrix own = points_.middleCols(level->first, level->count);
    const Eigen::Index later = level->first + level->count;
    Matrix block = level->kernel.between(own, points);
    if (later < size())
      block -= level->kernel.between(own, points_.rightCols(size() - later)) * weights.bottomRows(size() - later);
    solve_lower(level->own_root, block);
    solve_transposed(level->own_root, block);
    weights.middleRows(level->first, level->count) = block;
  }
  return weights;
}

Known SourceModel::know(const Matrix& points) const {
  Known known;
  known.points = points;
  if (stacking_ == Stacking::means || size() == 0) {
    known.mean = mean(points);
    known.white.resize(0, points.cols());
    known.excess.resize(0, points.cols());
    return known;
  }
  const bool boosted = stacking_ == Stacking::boosted;
  known.mean = boosted ? mean(points) : Vector(points.cols());
  known.white.resize(size(), points.cols());
  known.excess.resize(boosted ? size() : 0, points.cols());
  for (Eigen::Index first = 0; first < points.cols(); first += kBlock) {
    const Eigen::Index count = std::min(kBlock, points.cols() - first);
    const Matrix part = points.middleCols(first, count);
    Matrix white = cross(part);
    if (!boosted) known.mean.segment(first, count) = white.transpose() * weights_;
    solve_lower(root_, white);
    // Error variance of an estimator w . y: prior - 2 w . cross + w . K w = (prior - |white|^2) + |L^T w - white|^2.
    if (boosted)
      known.excess.middleCols(first, count) =
          Matrix(root_.transpose().triangularView<Eigen::Upper>() * stacked_weights(part)) - white;
    known.white.middleCols(first, count) = white;
  }
  return known;
}

Matrix SourceModel::covariance(const Known& a, const Known& b) const {
  Matrix sum = prior(a.points, b.points);
  if (a.white.rows() > 0) sum -= a.white.transpose() * b.white;
  if (a.excess.rows() > 0) sum += a.excess.transpose() * b.excess;
  return sum;
}

Vector SourceModel::variance(const Known& at) const {
  Vector sum = Vector::Constant(at.points.cols(), amplitude_);
  if (at.white.rows() > 0) sum -= at.white.colwise().squaredNorm().transpose();
  if (at.excess.rows() > 0) sum += at.excess.colwise().squaredNorm().transpose();
  return sum.cwiseMax(0);
}

}  // namespace transfer_gp
