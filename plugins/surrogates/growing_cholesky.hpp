// The Cholesky factor L of a positive definite matrix, to which rows are appended: n^2 operations each, not n^3.
#pragma once

#include "kernel.hpp"

namespace surrogates {

class GrowingCholesky {
 public:
  GrowingCholesky() = default;
  // False, and empty, where the matrix is not positive definite.
  bool compute(const Matrix& matrix);
  // The matrix grows by the row (beside, corner). False, and as before, where the result is not positive definite.
  bool append(const Vector& beside, double corner);

  Eigen::Index size() const { return size_; }
  Vector solve(const Vector& right) const;
  // L^-1 right, in place; whitens covariances. right has size() rows.
  void whiten(Matrix& right) const { top().triangularView<Eigen::Lower>().solveInPlace(right); }
  void whiten(Vector& right) const { top().triangularView<Eigen::Lower>().solveInPlace(right); }
  // L^-T right, in place.
  void unwhiten(Matrix& right) const { top().transpose().triangularView<Eigen::Upper>().solveInPlace(right); }
  double log_determinant() const { return 2 * factor_.diagonal().head(size_).array().log().sum(); }

 private:
  Eigen::Ref<const Matrix> top() const { return factor_.topLeftCorner(size_, size_); }

  Matrix factor_;  // may be larger than what is used
  Eigen::Index size_ = 0;
};

}  // namespace surrogates
