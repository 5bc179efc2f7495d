#include "kernel.hpp"

namespace surrogates {

Matrix squared_differences(const Eigen::Ref<const Eigen::RowVectorXd>& a,
                           const Eigen::Ref<const Eigen::RowVectorXd>& b) {
  return (a.transpose().replicate(1, b.size()) - b.replicate(a.size(), 1)).array().square();
}

void apply_shape(Shape shape, Eigen::ArrayXXd& squares) {
  if (shape == Shape::rbf) {
    squares = (-0.5 * squares).exp();
    return;
  }
  const Eigen::ArrayXXd root = (5 * squares).sqrt();
  squares = (1 + root + (5.0 / 3) * squares) * (-root).exp();
}

void apply_shape(Shape shape, Eigen::ArrayXXd& squares, Eigen::ArrayXXd& factor) {
  if (shape == Shape::rbf) {
    squares = (-0.5 * squares).exp();
    factor = squares;
    return;
  }
  const Eigen::ArrayXXd root = (5 * squares).sqrt();
  const Eigen::ArrayXXd decay = (-root).exp();
  squares = (1 + root + (5.0 / 3) * squares) * decay;
  factor = (5.0 / 3) * (1 + root) * decay;
}

Kernel::Kernel(Shape shape, const Vector& theta)
    : shape_(shape),
      amplitude_(std::exp(theta[0])),
      inverse_lengths_((-theta.segment(1, theta.size() - 2)).array().exp()) {}

Matrix Kernel::between(const Matrix& a, const Matrix& b) const {
  // |x - y|^2 = x.x + y.y - 2 x.y, one matrix product; relative to the first point to reduce cancellation.
  const Matrix ours = inverse_lengths_.asDiagonal() * (a.colwise() - a.col(0));
  const Matrix theirs = inverse_lengths_.asDiagonal() * (b.colwise() - a.col(0));
  Eigen::ArrayXXd squares = -2 * (ours.transpose() * theirs);
  squares.colwise() += ours.colwise().squaredNorm().transpose().array();
  squares.rowwise() += theirs.colwise().squaredNorm().array();
  squares = squares.max(0);
  apply_shape(shape_, squares);
  return amplitude_ * squares;
}

Vector Kernel::between(const Matrix& points, const Vector& at, Matrix* by_at) const {
  const Matrix away = (at.replicate(1, points.cols()) - points).array().colwise() * inverse_lengths_.array();
  Eigen::ArrayXXd squares = away.colwise().squaredNorm().transpose();
  Eigen::ArrayXXd factor;
  apply_shape(shape_, squares, factor);
  if (by_at)
    *by_at = (away.array().rowwise() * (-amplitude_ * factor.col(0)).transpose()).colwise() * inverse_lengths_.array();
  return amplitude_ * squares.col(0);
}

}  // namespace surrogates
