// The local model on residuals with known best pose, Jacobian and curvature.
#include "local_model.h"

#include <gtest/gtest.h>

#include <functional>
#include <relign/random.hpp>

namespace relign {
namespace {

using ceres_plugin::fit_locally;
using ceres_plugin::LocalModel;
using ceres_plugin::Matrix;
using ceres_plugin::Neighbourhood;
using ceres_plugin::Vector;

// `kNumbers` residuals with sensitivities 1, 0.3 and 0.1 along three rotated directions.
struct Lens {
  static constexpr Eigen::Index kNumbers = 400, kAxes = 3;

  explicit Lens(std::uint64_t seed) : random(seed) {
    const Matrix images = orthonormal(kNumbers);
    directions = orthonormal(kAxes);
    jacobian = images * Vector3(1, 0.3, 0.1).asDiagonal() * directions.transpose();
    bend = Vector::NullaryExpr(kNumbers, [&] { return random.normal(); });
    bend.normalize();
  }
  using Vector3 = Eigen::Vector3d;

  Matrix orthonormal(Eigen::Index rows) {
    const Matrix any = Matrix::NullaryExpr(rows, kAxes, [&] { return random.normal(); });
    return Eigen::HouseholderQR<Matrix>(any).householderQ() * Matrix::Identity(rows, kAxes);
  }

  void evaluate(const Vector& x) {
    const Vector away = x - best;
    Vector residual = jacobian * away + curvature * away.squaredNorm() * (bend + jacobian * Vector3(1, 1, 1));
    for (double& number : residual) number += noise * random.normal();
    points.push_back(x);
    residuals.conservativeResize(kNumbers, static_cast<Eigen::Index>(points.size()));
    residuals.col(residuals.cols() - 1) = residual;
  }
  // Evaluates `at` and both ways along each direction, `rounds` times.
  void evaluate_around(const Vector& at, double length, int rounds = 1) {
    for (int round = 0; round < rounds; ++round)
      for (Eigen::Index axis = 0; axis < kAxes; ++axis)
        for (const double way : {0.0, length, -length}) evaluate(at + way * directions.col(axis));
  }
  LocalModel fit(const Vector& at, double noise_power, double width = 0.15, double reach = 1) const {
    const Neighbourhood near{Matrix::Identity(kAxes, kAxes) / (width * width), reach, 1e-4};
    return fit_locally(points, residuals.transpose() * residuals, noise_power, at, Matrix::Zero(0, kAxes), near, lower,
                       upper);
  }

  Random random;
  Vector best = Vector3(0.5, 0.4, 0.6), bend, lower = Vector3(0, 0, 0), upper = Vector3(1, 1, 1);
  Matrix directions, jacobian, residuals;
  double curvature = 0, noise = 0;
  std::vector<Vector> points;
};

TEST(LocalModel, FindsBestPoseAndDirectionsOfLinearResiduals) {
  Lens lens(1);
  const Vector at = lens.best + 0.05 * Vector::Ones(3);
  lens.evaluate_around(at, 0.1);
  const LocalModel model = lens.fit(at, 0);
  EXPECT_LT((model.optimum - lens.best).norm(), 0.01);  // not 0 because of the damping
  const double expected[] = {0.1, 0.3, 1};              // the least sensitive first
  for (Eigen::Index i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::sqrt(model.strength[i]), expected[i], 0.02 * expected[i]);
    EXPECT_NEAR(std::fabs(model.axes.col(i).dot(lens.directions.col(2 - i))), 1, 0.01);
  }
}

TEST(LocalModel, SeparatesCurvatureFromResidual) {
  // Both ends of each probe have the same curvature term, which an affine model would attribute to the residual at the
  // pose.
  Lens lens(2);
  lens.curvature = 2;
  lens.evaluate_around(lens.best, 0.1, 20);
  EXPECT_LT((lens.fit(lens.best, 0).optimum - lens.best).norm(), 0.01);
}

TEST(LocalModel, CorrectsSensitivitiesForNoise) {
  Lens lens(3);
  lens.noise = 0.002;
  const Vector at = lens.best + 0.05 * lens.directions.col(2);
  lens.evaluate_around(at, 0.1);
  const double per_capture = lens.noise * lens.noise * Lens::kNumbers;
  const LocalModel corrected = lens.fit(at, per_capture), plain = lens.fit(at, 0);
  EXPECT_NEAR(corrected.strength[0], 0.01, 0.004);
  EXPECT_GT(plain.strength[0], 1.5 * corrected.strength[0]);
  EXPECT_LT((corrected.optimum - lens.best).norm(), 0.02);
}

TEST(LocalModel, LimitsStepsToReachAndBox) {
  Lens lens(4);
  const Vector at = lens.best + 0.2 * Vector::Ones(3);
  lens.evaluate_around(at, 0.1);
  EXPECT_NEAR((lens.fit(at, 0, 0.15, 0.02).optimum - at).norm(), 0.02, 1e-9);
  lens.lower = at - 0.05 * Vector::Ones(3);
  const LocalModel held = lens.fit(at, 0);
  for (Eigen::Index axis = 0; axis < 3; ++axis) EXPECT_GE(held.optimum[axis], lens.lower[axis]);
}

TEST(LocalModel, KeepsPoseWithoutInformation) {
  Lens lens(5);
  lens.jacobian.setZero();
  lens.evaluate(lens.best);
  EXPECT_EQ(lens.fit(lens.best, 0).optimum, lens.best);  // one capture
  lens.evaluate_around(lens.best, 0.1);
  EXPECT_EQ(lens.fit(lens.best, 0).optimum, lens.best);  // all equal
}

}  // namespace
}  // namespace relign
