// Stationary kernels with one length scale per dimension. Points are columns.
//
// theta: natural logarithms of amplitude, length 1 .. length d, noise, in scikit-learn's order. Amplitude and noise are
// perturbations.
#pragma once

#include <Eigen/Core>

namespace surrogates {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

enum class Shape { matern52, rbf };

class Kernel {
 public:
  Kernel(Shape shape, const Vector& theta);

  double amplitude() const { return amplitude_; }  // prior variance
  // Covariance of the columns of a with the columns of b.
  Matrix between(const Matrix& a, const Matrix& b) const;
  // Covariance of the points with `at`; by_at (d x n, may be null) receives the derivatives by the coordinates of `at`.
  Vector between(const Matrix& points, const Vector& at, Matrix* by_at) const;

 private:
  Shape shape_;
  double amplitude_;
  Vector inverse_lengths_;
};

// Squared differences of all pairs of points along one dimension.
Matrix squared_differences(const Eigen::Ref<const Eigen::RowVectorXd>& a,
                           const Eigen::Ref<const Eigen::RowVectorXd>& b);

// Replaces scaled squared distances r^2 by the kernel of amplitude 1. The second overload also returns the common
// factor of its derivatives: d kernel / d log length_i = factor * (difference_i / length_i)^2.
void apply_shape(Shape shape, Eigen::ArrayXXd& squares);
void apply_shape(Shape shape, Eigen::ArrayXXd& squares, Eigen::ArrayXXd& factor);

}  // namespace surrogates
