// Acquisition functions, bounded L-BFGS, candidates, preprocessing of merits, and the growing Cholesky factor.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "acquisition.hpp"
#include "candidates.hpp"
#include "warp.hpp"

namespace surrogates {
namespace {

const double kNan = std::numeric_limits<double>::quiet_NaN();

// Against tabulated values of the normal distribution.
TEST(Acquisition, MatchesTabulatedValues) {
  const AcquisitionSetup setup{1.0, 0.0, 2.0};
  EXPECT_NEAR(acquisition_cost(Acquisition::expected_improvement, setup, 1, 1).value, -0.3989422804, 1e-9);
  EXPECT_NEAR(acquisition_cost(Acquisition::expected_improvement, setup, 0, 1).value, -1.0833154706, 1e-9);
  EXPECT_NEAR(acquisition_cost(Acquisition::probability, setup, 0, 1).value, -0.8413447461, 1e-9);
  EXPECT_EQ(acquisition_cost(Acquisition::lower_bound, setup, 3, 0.5).value, 2);
  EXPECT_EQ(acquisition_cost(Acquisition::expected_improvement, setup, 0, 0).value, 0);
}

TEST(Acquisition, LogImprovementMatchesLogOfImprovement) {
  const AcquisitionSetup setup{0.0, 0.0, 0.0};
  for (const double mean : {-3.0, -0.2, 0.0, 1.0, 4.9, 5.1, 8.0}) {
    SCOPED_TRACE(mean);
    const Cost plain = acquisition_cost(Acquisition::expected_improvement, setup, mean, 1.1);
    const Cost log = acquisition_cost(Acquisition::log_expected_improvement, setup, mean, 1.1);
    // At larger means expected improvement loses digits to cancellation, 1 in 50 million at 8.
    EXPECT_NEAR(log.value, -std::log(-plain.value), 1e-10 * std::exp(0.5 * mean * mean / 1.21));
    EXPECT_NEAR(log.by_mean, plain.by_mean / -plain.value, 1e-6);
    EXPECT_NEAR(log.by_deviation, plain.by_deviation / -plain.value, 1e-6);
  }
}

// h(-t) = density(t) / t^2 (1 - 3 / t^2 + 15 / t^4 - ...).
TEST(Acquisition, LogImprovementHasGradientWhereImprovementUnderflows) {
  const AcquisitionSetup setup{0.0, 0.0, 0.0};
  const double t = 200;
  const Cost cost = acquisition_cost(Acquisition::log_expected_improvement, setup, t, 1);
  const double expected = 0.5 * t * t + 0.5 * std::log(2 * std::acos(-1.0)) + 2 * std::log(t) + 3 / (t * t);
  EXPECT_NEAR(cost.value, expected, 1e-7);
  EXPECT_NEAR(cost.by_mean, t + 2 / t, 1e-4);
  EXPECT_TRUE(std::isfinite(acquisition_cost(Acquisition::log_expected_improvement, setup, 1, 0).value));
}

TEST(BoundedLbfgs, MinimisesRosenbrockFreeAndBounded) {
  int calls = 0;
  const Objective rosenbrock = [&](const Vector& x, Vector& gradient) {
    ++calls;
    const double across = x[1] - x[0] * x[0];
    gradient = Vector{{-400 * x[0] * across - 2 * (1 - x[0]), 200 * across}};
    return 100 * across * across + (1 - x[0]) * (1 - x[0]);
  };
  SearchLimits limits;
  limits.decrease = 0;
  const Minimum free = minimize(rosenbrock, Vector{{-1.2, 1}}, Vector{{-2, -2}}, Vector{{2, 2}}, limits);
  EXPECT_LT((free.at - Vector::Ones(2)).norm(), 1e-4);
  EXPECT_LT(calls, 100);
  // Under x <= 0.5 the optimum is (0.5, 0.25).
  const Minimum held = minimize(rosenbrock, Vector{{-1.2, 1}}, Vector{{-2, -2}}, Vector{{0.5, 2}}, limits);
  EXPECT_LT((held.at - Vector{{0.5, 0.25}}).norm(), 1e-4);
}

TEST(Candidates, LowestAreSortedWithNanLast) {
  EXPECT_EQ(lowest(Vector{{3, kNan, 1, 1, 2}}, 4), (std::vector<Eigen::Index>{2, 3, 4, 0}));
  EXPECT_EQ(lowest(Vector{{kNan, 5}}, 9), (std::vector<Eigen::Index>{1, 0}));
}

TEST(Candidates, PolishFindsMinimumNearBestCandidate) {
  const Objective waves = [](const Vector& x, Vector& gradient) {
    gradient = Vector::Constant(1, 12 * std::cos(12 * x[0]) + 1);
    return std::sin(12 * x[0]) + x[0];
  };
  const Matrix candidates{{0.1, 0.45, 0.9}};
  Vector costs(3);
  Vector unused;
  for (Eigen::Index i = 0; i < 3; ++i) costs[i] = waves(Vector(candidates.col(i)), unused);
  // A minimum: cos(12 x) = -1/12 with positive curvature.
  EXPECT_NEAR(polish(waves, candidates, costs, 2, 20).at[0], (2 * std::acos(-1.0) - std::acos(-1.0 / 12)) / 12, 1e-4);
}

TEST(UnitBox, RoundTripsAndStaysInside) {
  const UnitBox box(relign::Box{{-0.5, 0.2, 0.1}, {0.5, 0.2, 0.7}});
  const relign::Pose pose = box.to_pose(Vector{{0.25, 0.9, 1}});
  EXPECT_DOUBLE_EQ(pose[0], -0.25);
  EXPECT_EQ(pose[1], 0.2);
  EXPECT_EQ(pose[2], 0.7);
  EXPECT_TRUE(box.to_unit(pose).isApprox(Vector{{0.25, 0, 1}}, 1e-12));
}

TEST(Standard, KeepsScaleOfEqualValuesAndReplacesUnusableOnes) {
  EXPECT_EQ(Standard(Vector::Constant(7, 0.1)).scale, 1);
  EXPECT_NEAR(Standard(Vector{{1, 3}}).scale, 1, 1e-15);
  EXPECT_EQ(usable_merits({1, kNan, 3, 1e300, -std::numeric_limits<double>::infinity()}), (Vector{{1, 3, 3, 3, 3}}));
  EXPECT_EQ(usable_merits({kNan, kNan}), (Vector{{0, 0}}));
}

TEST(Warp, MatchesYeoJohnson) {
  EXPECT_DOUBLE_EQ(yeo_johnson(3, 0.5), 2);
  EXPECT_DOUBLE_EQ(yeo_johnson(-3, 1.5), -2);
  EXPECT_DOUBLE_EQ(yeo_johnson(std::exp(1.0) - 1, 0), 1);
  EXPECT_NEAR(yeo_johnson(2, 1e-8), yeo_johnson(2, 0), 1e-7);
  for (const double value : {-2.0, 0.0, 5.0}) EXPECT_DOUBLE_EQ(yeo_johnson(value, 1), value);
}

TEST(Warp, RemovesSkewIndependentOfScale) {
  relign::Random random(5);
  Vector normal(400);
  for (double& value : normal) value = random.normal();
  EXPECT_NEAR(best_power(Standard(normal).apply(normal)), 1, 0.15);
  const Vector tail = normal.array().exp();
  const auto skew = [](const Vector& values) { return Standard(values).apply(values).array().cube().mean(); };
  EXPECT_GT(skew(tail), 2);
  EXPECT_LT(std::fabs(skew(warped(tail))), 0.3);
  EXPECT_LT((warped(tail) - warped(1e-3 * tail.array() + 8)).norm(), 1e-6);
  EXPECT_EQ(warped(Vector::Constant(5, 2)), Vector::Zero(5));
}

TEST(GrowingCholesky, MatchesFactorOfWholeMatrix) {
  relign::Random random(7);
  const Matrix points = uniform_points(random, 40, 40);
  const Matrix matrix = points * points.transpose() + Matrix::Identity(40, 40);
  GrowingCholesky grown;
  for (Eigen::Index i = 0; i < 40; ++i) ASSERT_TRUE(grown.append(matrix.col(i).head(i), matrix(i, i)));
  GrowingCholesky whole;
  ASSERT_TRUE(whole.compute(matrix));
  EXPECT_LT((grown.solve(points.col(3)) - whole.solve(points.col(3))).norm(), 1e-10);
  EXPECT_NEAR(grown.log_determinant(), whole.log_determinant(), 1e-10);
  EXPECT_LT((matrix * whole.solve(points.col(3)) - points.col(3)).norm(), 1e-10);
  EXPECT_FALSE(grown.append(matrix.col(3), matrix(3, 3) - 0.5));  // a repeated row with a smaller diagonal: indefinite
  EXPECT_EQ(grown.size(), 40);
  EXPECT_FALSE(whole.compute(-matrix));
}

}  // namespace
}  // namespace surrogates
