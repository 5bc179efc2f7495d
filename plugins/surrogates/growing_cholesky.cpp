#include "growing_cholesky.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace surrogates {

bool GrowingCholesky::compute(const Matrix& matrix) {
  const Eigen::LLT<Matrix> made(matrix);
  size_ = 0;
  if (made.info() != Eigen::Success || !made.matrixLLT().diagonal().allFinite()) return false;
  factor_ = made.matrixL();
  size_ = matrix.rows();
  return true;
}

bool GrowingCholesky::append(const Vector& beside, double corner) {
  Vector row = beside;
  if (size_ > 0) whiten(row);
  const double left = corner - row.squaredNorm();
  if (!(left > 0) || !std::isfinite(left)) return false;
  if (size_ == factor_.rows()) {
    const Eigen::Index room = std::max<Eigen::Index>(16, 2 * size_);
    factor_.conservativeResize(room, room);
  }
  factor_.row(size_).head(size_) = row.transpose();
  factor_.col(size_).head(size_).setZero();
  factor_(size_, size_) = std::sqrt(left);
  ++size_;
  return true;
}

Vector GrowingCholesky::solve(const Vector& right) const {
  Vector solved = right;
  top().triangularView<Eigen::Lower>().solveInPlace(solved);
  top().transpose().triangularView<Eigen::Upper>().solveInPlace(solved);
  return solved;
}

}  // namespace surrogates
