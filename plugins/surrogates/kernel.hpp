// Stationary kernels with one length per dimension. Points are columns.
//
// theta: natural logarithms of amplitude, length 1 .. length d, noise; the order of scikit-learn. Amplitude and noise
// are variances.
#pragma once

#include <Eigen/Core>

namespace surrogates {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

enum class Shape { matern52, rbf };

class Kernel {
 public:
  Kernel(Shape shape, const Vector& theta);

  double amplitude() const { return amplitude_; }  // the variance anywhere
  // The covariance of every column of a with every column of b.
  Matrix between(const Matrix& a, const Matrix& b) const;
  // The covariance of every point with one more; by_at, d x n, receives the derivatives by its coordinates.
  Vector between(const Matrix& points, const Vector& at, Matrix* by_at) const;

 private:
  Shape shape_;
  double amplitude_;
  Vector inverse_lengths_;
};

// Per pair of points: the squared differences along one dimension.
Matrix squared_differences(const Eigen::Ref<const Eigen::RowVectorXd>& a,
                           const Eigen::Ref<const Eigen::RowVectorXd>& b);

// Of the scaled squared distance r^2, in place: the kernel of amplitude 1. The second form also gives the common
// factor of its derivatives: d kernel / d log length_i = factor * (difference_i / length_i)^2.
void apply_shape(Shape shape, Eigen::ArrayXXd& squares);
void apply_shape(Shape shape, Eigen::ArrayXXd& squares, Eigen::ArrayXXd& factor);

}  // namespace surrogates
