// Disturbances of a capture that least squares must not mistake for a movement of the lens: gain, offset and smooth
// stray light. They are marginalised: for r = J x + N c + noise, with white noise of variance s^2 and independent
// coefficients c of known deviations (columns of N in units of them), x is estimated with the weight
// W = 1 - N (N'N + s^2)^-1 N', the inverse covariance of N c + noise times s^2 (Sherman, Morrison, Woodbury).
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace least_squares {

// Products of cosines, cos(pi i x) cos(pi j y) with 1 <= i + j <= order for x, y from 0 to 1 across the image: a basis
// of smooth fields without the constant. Pixels x fields; images as in binning.hpp.
inline Eigen::MatrixXf smooth_fields(Eigen::Index width, Eigen::Index height, Eigen::Index order) {
  const auto waves = [order](Eigen::Index count) {
    constexpr float kPi = 3.14159265F;
    return Eigen::MatrixXf::NullaryExpr(count, order + 1,
                                        [count](Eigen::Index place, Eigen::Index along) {
                                          return std::cos(kPi * static_cast<float>(along) *
                                                          (static_cast<float>(place) + 0.5F) /
                                                          static_cast<float>(count));
                                        })
        .eval();
  };
  const Eigen::MatrixXf across = waves(width), down = waves(height);
  Eigen::MatrixXf fields(width * height, (order + 1) * (order + 2) / 2 - 1);
  Eigen::Index field = 0;
  for (Eigen::Index sum = 1; sum <= order; ++sum)
    for (Eigen::Index i = 0; i <= sum; ++i, ++field)
      for (Eigen::Index y = 0; y < height; ++y)
        fields.col(field).segment(y * width, width) = down(y, sum - i) * across.col(i);
  return fields;
}

// The disturbances of an image; none if default-constructed.
template <class Number>
class Nuisance {
 public:
  using Pixels = Eigen::Matrix<Number, Eigen::Dynamic, 1>;
  struct Size {
    Eigen::Index width = 0, height = 0;
    Eigen::Index order = 3;  // of the smooth fields
  };

  Nuisance() = default;
  // image: the expected one, for the gain. stray: expected stray light, whose strength is uncertain; may be empty.
  // noise: variance of a residual. weight: of each pixel; residuals are multiplied by it before all functions below;
  // empty: 1.
  Nuisance(const Pixels& image, const Pixels& stray, Size size, double noise, const Pixels& weight = {}) {
    const Number level = std::sqrt(image.squaredNorm() / static_cast<Number>(std::max<Eigen::Index>(image.size(), 1)));
    if (!(level > 0)) return;
    const Eigen::MatrixXf fields = smooth_fields(size.width, size.height, size.order);
    Columns columns(image.size(), 3 + fields.cols());
    columns.col(0) = kGain * image;
    columns.col(1).setConstant(kOffset * level);
    columns.col(2).setZero();
    if (stray.size() > 0) columns.col(2) = kStray * stray;
    columns.rightCols(fields.cols()) = kField * level * fields.template cast<Number>();
    if (weight.size() > 0) columns = (weight.asDiagonal() * columns).eval();
    const Eigen::MatrixXd precise = columns.template cast<double>();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(precise.transpose() * precise);
    const Eigen::VectorXd squares = solver.eigenvalues();
    const Eigen::VectorXd inverse = squares.unaryExpr(
        [least = 1e-12 * squares.maxCoeff()](double square) { return square > least ? 1 / std::sqrt(square) : 0.0; });
    const Eigen::MatrixXd scaled = solver.eigenvectors() * inverse.asDiagonal();
    basis_ = columns * scaled.template cast<Number>();
    gain_ = kGain * scaled.row(0).transpose();
    share_ = squares.array().cwiseMax(0) / (squares.array().cwiseMax(0) + noise);
  }

  // The fitted disturbances of a residual: r'r - r'W r, and the capture's gain relative to the image's.
  struct Fit {
    double explained = 0, gain = 1;
  };
  Fit fit(const Pixels& residual) const {
    if (basis_.cols() == 0) return {};
    const Eigen::VectorXd along = (basis_.transpose() * residual).template cast<double>();
    return {along.cwiseAbs2().dot(share_), 1 + along.cwiseProduct(share_).dot(gain_)};
  }
  // W r
  Pixels without(const Pixels& residual) const { return reduced(residual, share_); }
  // The symmetric square root of W, times r: for least squares of unweighted residuals.
  Pixels whitened(const Pixels& residual) const {
    return reduced(residual, 1 - (1 - share_.array()).cwiseMax(0).sqrt());
  }

 private:
  using Columns = Eigen::Matrix<Number, Eigen::Dynamic, Eigen::Dynamic>;
  // Deviations of the coefficients: generous, since thousands of pixels determine them. Offset and fields are shares of
  // the image's root mean square, which is about half of the white level.
  static constexpr Number kGain = Number(0.15), kOffset = Number(0.1), kField = Number(0.05), kStray = Number(0.5);

  Pixels reduced(const Pixels& residual, const Eigen::VectorXd& share) const {
    if (basis_.cols() == 0) return residual;
    const Pixels along = basis_.transpose() * residual;
    return residual - basis_ * along.cwiseProduct(share.template cast<Number>());
  }

  Columns basis_;  // pixels x disturbances, orthonormal
  Eigen::VectorXd gain_, share_;
};

}  // namespace least_squares
