// The Cholesky factor L of a positive definite matrix to which rows can be appended in n^2 operations each.
#pragma once

#include "kernel.hpp"

namespace surrogates {

class GrowingCholesky {
 public:
  GrowingCholesky() = default;
  // Returns false and leaves the factor empty if the matrix is not positive definite.
  bool compute(const Matrix& matrix);
  // Appends the row (beside, corner) to the matrix. Returns false and changes nothing if the result is not positive
  // definite.
  bool append(const Vector& beside, double corner);

  Eigen::Index size() const { return size_; }
  Vector solve(const Vector& right) const;
  // Computes L^-1 right in place. right has size() rows.
  void whiten(Matrix& right) const { top().triangularView<Eigen::Lower>().solveInPlace(right); }
  void whiten(Vector& right) const { top().triangularView<Eigen::Lower>().solveInPlace(right); }
  // Computes L^-T right in place.
  void unwhiten(Matrix& right) const { top().transpose().triangularView<Eigen::Upper>().solveInPlace(right); }
  double log_determinant() const { return 2 * factor_.diagonal().head(size_).array().log().sum(); }

 private:
  Eigen::Ref<const Matrix> top() const { return factor_.topLeftCorner(size_, size_); }

  Matrix factor_;  // allocated in steps; the top left size_ x size_ block is used
  Eigen::Index size_ = 0;
};

}  // namespace surrogates
