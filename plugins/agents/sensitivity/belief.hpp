// A guess at a pose with what it is worth. Guesses of many captures are put together by adding.
#pragma once

#include <Eigen/Dense>

namespace sensitivity {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

struct Belief {
  Matrix information;  // inverse of the covariance; may know nothing of some directions
  Vector weighed;      // information * mean

  static Belief around(const Vector& mean, double deviation) {
    const Matrix information = Matrix::Identity(mean.size(), mean.size()) / (deviation * deviation);
    return {information, information * mean};
  }
  static Belief nothing(Eigen::Index axes) { return {Matrix::Zero(axes, axes), Vector::Zero(axes)}; }

  // Of a belief that knows something of every direction.
  Vector mean() const { return information.ldlt().solve(weighed); }
  Matrix covariance() const {
    return information.ldlt().solve(Matrix::Identity(information.rows(), information.cols()));
  }
  bool finite() const { return information.allFinite() && weighed.allFinite(); }

  Belief with(const Belief& other) const { return {information + other.information, weighed + other.weighed}; }

  // The same guess when it is off by a further error of this covariance.
  Belief blunted(const Matrix& covariance) const {
    // (Y^-1 + C)^-1 = (1 + Y C)^-1 Y asks for no inverse of an information that knows nothing of a direction.
    const Matrix spread = Matrix::Identity(information.rows(), information.cols()) + information * covariance;
    const Eigen::PartialPivLU<Matrix> solver(spread);
    const Matrix left = solver.solve(information);
    return {0.5 * (left + left.transpose()), solver.solve(weighed)};
  }

  // "The lens is this far from the best pose" said at a pose: where the best pose is.
  Belief seen_from(const Vector& pose) const { return {information, information * pose - weighed}; }
};

}  // namespace sensitivity
