// The bound of one more image, compared with values computed by hand and with estimates that reach it.
#include "trials/next_image.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <relign/random.hpp>

namespace relign::trials {
namespace {

Eigen::MatrixXd some_jacobian(Eigen::Index pixels, Eigen::Index axes) {
  Random random(3, 0);
  return Eigen::MatrixXd::NullaryExpr(pixels, axes, [&] { return random.normal(); });
}

TEST(NextImage, UniformNoiseGivesVarianceTimesAxesOverPixels) {
  const Eigen::MatrixXd jacobian = some_jacobian(300, 5);
  const Eigen::VectorXd weights = Eigen::VectorXd::Constant(300, 1 / 0.04);
  EXPECT_NEAR(next_image_excess(jacobian, weights), 5 * 0.04 / 300, 1e-15);
  Eigen::MatrixXd other_units = jacobian;
  other_units.col(2) *= 1000;
  EXPECT_NEAR(next_image_excess(other_units, weights), 5 * 0.04 / 300, 1e-12);
}

// Two pixels, one axis: J = (3, 4), v = (2, 8); C = 1 / (9/2 + 16/8) = 1/6.5; J'J C / 2 = 25 / 13.
TEST(NextImage, MatchesUnevenNoiseByHand) {
  const Eigen::MatrixXd jacobian = (Eigen::MatrixXd(2, 1) << 3, 4).finished();
  const Eigen::VectorXd weights = (Eigen::VectorXd(2) << 0.5, 0.125).finished();
  EXPECT_NEAR(next_image_excess(jacobian, weights), 25.0 / 13.0, 1e-14);
}

TEST(NextImage, IgnoresAxesWithoutEffect) {
  Eigen::MatrixXd jacobian = some_jacobian(200, 4);
  jacobian.col(1).setZero();
  jacobian.col(3) = -2 * jacobian.col(0);
  EXPECT_NEAR(next_image_excess(jacobian, Eigen::VectorXd::Constant(200, 10)), 2 * 0.1 / 200, 1e-12);
  EXPECT_EQ(next_image_excess(Eigen::MatrixXd::Zero(50, 3), Eigen::VectorXd::Constant(50, 1)), 0);
}

TEST(NextImage, FitsNoiseThatGrowsWithTheSignal) {
  const Eigen::VectorXd mean = Eigen::VectorXd::LinSpaced(101, 0, 1);
  const Eigen::VectorXd photons = 0.5 * mean, both = (0.02 + 0.5 * mean.array()).matrix();
  EXPECT_TRUE(noise_law(mean, both).isApprox(both, 1e-12));
  const Eigen::VectorXd law = noise_law(mean, photons);
  EXPECT_NEAR(law[50], photons[50], 1e-12);
  EXPECT_NEAR(law[0], 1e-3 * 0.25, 1e-12) << "bounded weight of a black pixel";
  const Eigen::VectorXd falling = 0.1 - 0.05 * mean.array();  // unlike a camera: the fit is constant
  EXPECT_NEAR(noise_law(mean, falling)[100], 0.075, 1e-12);
  EXPECT_EQ(noise_law(mean, Eigen::VectorXd::Zero(101)).maxCoeff(), 0);
}

// Weighted least squares is efficient for normal noise: its error is the bound.
TEST(NextImage, EfficientEstimateReachesTheBound) {
  constexpr Eigen::Index kPixels = 60;
  constexpr int kImages = 20'000;
  const Eigen::MatrixXd jacobian = some_jacobian(kPixels, 3);
  Random random(11, 0);
  const Eigen::VectorXd deviation = Eigen::VectorXd::NullaryExpr(kPixels, [&] { return 0.1 + random.uniform(); });
  const Eigen::VectorXd weights = deviation.cwiseAbs2().cwiseInverse();
  const Eigen::MatrixXd estimator = (jacobian.transpose() * weights.asDiagonal() * jacobian)
                                        .ldlt()
                                        .solve(jacobian.transpose() * weights.asDiagonal());
  double sum = 0;
  for (int image = 0; image < kImages; ++image) {
    const Eigen::VectorXd noise =
        deviation.cwiseProduct(Eigen::VectorXd::NullaryExpr(kPixels, [&] { return random.normal(); }));
    sum += (jacobian * (estimator * noise)).squaredNorm() / kPixels;
  }
  EXPECT_NEAR(sum / kImages / next_image_excess(jacobian, weights), 1, 0.03);
}

}  // namespace
}  // namespace relign::trials
