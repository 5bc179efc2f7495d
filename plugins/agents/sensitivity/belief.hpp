// A normal distribution over poses in information form: independent estimates are combined by addition.
#pragma once

#include <Eigen/Dense>

namespace sensitivity {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

struct Belief {
  Matrix information;  // inverse of the covariance; may be singular
  Vector weighed;      // information * mean

  static Belief around(const Vector& mean, double deviation) {
    const Matrix information = Matrix::Identity(mean.size(), mean.size()) / (deviation * deviation);
    return {information, information * mean};
  }
  static Belief nothing(Eigen::Index axes) { return {Matrix::Zero(axes, axes), Vector::Zero(axes)}; }

  // mean() and covariance() need an invertible information matrix.
  Vector mean() const { return information.ldlt().solve(weighed); }
  Matrix covariance() const {
    return information.ldlt().solve(Matrix::Identity(information.rows(), information.cols()));
  }
  bool finite() const { return information.allFinite() && weighed.allFinite(); }

  Belief with(const Belief& other) const { return {information + other.information, weighed + other.weighed}; }

  // Adds an independent error of this covariance.
  Belief inflated(const Matrix& covariance) const {
    // (Y^-1 + C)^-1 = (1 + Y C)^-1 Y, which also holds for a singular Y.
    const Matrix spread = Matrix::Identity(information.rows(), information.cols()) + information * covariance;
    const Eigen::PartialPivLU<Matrix> solver(spread);
    const Matrix left = solver.solve(information);
    return {0.5 * (left + left.transpose()), solver.solve(weighed)};
  }

  // For a belief about the displacement from the best pose to `pose`: the belief about the best pose.
  Belief best_pose_from(const Vector& pose) const { return {information, information * pose - weighed}; }
};

}  // namespace sensitivity
