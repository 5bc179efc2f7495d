// The parts of TuRBO: length rule, scaled region, scrambled Sobol points, masked candidates, fit, and restarts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "scrambled_sobol.hpp"
#include "search.hpp"
#include "surrogates/candidates.hpp"

namespace bo_turbo {
namespace {

TEST(TrustRegion, DoublesAfterThreeSuccessesInARowUpToItsLargestLength) {
  TrustRegion region(6);
  for (const bool success : {true, true, false, true, true}) region.record(success);
  EXPECT_EQ(region.length(), 0.8);
  region.record(true);
  EXPECT_EQ(region.length(), 1.6);
  for (int i = 0; i < 3; ++i) region.record(true);
  EXPECT_EQ(region.length(), 1.6);
}

TEST(TrustRegion, HalvesAfterAsManyFailuresAsAxesAtLeastFour) {
  for (const auto& [axes, tolerance] : {std::pair<std::size_t, int>{1, 4}, {4, 4}, {6, 6}, {10, 10}}) {
    TrustRegion region(axes);
    for (int i = 0; i < tolerance - 1; ++i) region.record(false);
    region.record(true);  // starts the count again
    for (int i = 0; i < tolerance - 1; ++i) region.record(false);
    EXPECT_EQ(region.length(), 0.8) << axes;
    region.record(false);
    EXPECT_EQ(region.length(), 0.4) << axes;
  }
}

TEST(TrustRegion, CollapsesAtTheSeventhHalving) {
  TrustRegion region(4);
  for (int i = 0; i < 27; ++i) region.record(false);
  EXPECT_EQ(region.length(), 0.0125);
  EXPECT_FALSE(region.collapsed());
  region.record(false);
  EXPECT_TRUE(region.collapsed());
}

TEST(TrustRegion, SuccessLowersTheBestByAThousandth) {
  EXPECT_TRUE(is_success(0.9989, 1));
  EXPECT_FALSE(is_success(0.9991, 1));
  EXPECT_TRUE(is_success(-1.0011, -1));
  EXPECT_FALSE(is_success(-1.0009, -1));
}

TEST(TrustRegion, SidesFollowLengthScalesAtConstantVolume) {
  TrustRegion region(3);
  for (int i = 0; i < 8; ++i) region.record(false);
  ASSERT_EQ(region.length(), 0.2);
  const Sides sides = region.sides(Vector::Constant(3, 0.5), Vector{{0.25, 0.5, 1}});
  const Vector widths = sides.upper - sides.lower;
  EXPECT_NEAR(widths[0], 0.1, 1e-12);
  EXPECT_NEAR(widths[1], 0.2, 1e-12);
  EXPECT_NEAR(widths[2], 0.4, 1e-12);
  EXPECT_NEAR(widths.prod(), std::pow(0.2, 3), 1e-12);
  const Sides cut = region.sides(Vector{{0, 0.95, 0.5}}, Vector::Ones(3));
  EXPECT_EQ(cut.lower[0], 0);
  EXPECT_NEAR(cut.upper[0], 0.1, 1e-12);
  EXPECT_NEAR(cut.lower[1], 0.85, 1e-12);
  EXPECT_EQ(cut.upper[1], 1);
}

// The sequence without its first point has one point in each of 2^k - 1 of the 2^k intervals of an axis, and the
// scramble keeps that.
TEST(ScrambledSobol, FillsEveryIntervalOfEveryAxisButOne) {
  for (const std::uint64_t seed : {1, 2}) {
    relign::Random random(seed);
    const Matrix points = scrambled_sobol(random, 64, 255);
    for (Eigen::Index axis = 0; axis < 64; ++axis) {
      std::vector<int> counts(256, 0);
      for (const double x : points.row(axis)) ++counts.at(static_cast<std::size_t>(256 * x));
      EXPECT_EQ(std::count(counts.begin(), counts.end(), 1), 255) << axis;
    }
  }
}

// In two axes every one of the 4 x 4 cells has the same share of 2^k points: 16 of 256, less the missing first one.
TEST(ScrambledSobol, FillsCellsOfTwoAxesEvenlyAndDependsOnSeed) {
  relign::Random random(3);
  const Matrix points = scrambled_sobol(random, 2, 255);
  Eigen::Matrix4i cells = Eigen::Matrix4i::Zero();
  for (const auto& point : points.colwise()) ++cells(static_cast<int>(4 * point[0]), static_cast<int>(4 * point[1]));
  EXPECT_EQ(cells.minCoeff(), 15);
  EXPECT_EQ(cells.maxCoeff(), 16);
  EXPECT_NE(points, scrambled_sobol(random, 2, 255));
}

TEST(MaskedCandidates, ReplaceEveryCoordinateWithinTheSidesAtProbabilityOne) {
  relign::Random random(4);
  const Vector centre = Vector::Constant(6, 0.9);
  const Sides sides{Vector::Constant(6, 0.7), Vector::Ones(6)};
  const Matrix made = masked_candidates(random, centre, sides, 600, 1);
  ASSERT_EQ(made.cols(), 600);
  EXPECT_GE(made.minCoeff(), 0.7);
  EXPECT_LE(made.maxCoeff(), 1);
  EXPECT_EQ((made.array() == 0.9).count(), 0);
  EXPECT_NEAR(made.mean(), 0.85, 1e-3);
}

TEST(MaskedCandidates, KeepCoordinatesOfTheCentreAtLowProbabilityButNeverAll) {
  relign::Random random(5);
  const Vector centre = Vector::Constant(40, 0.5);
  const Sides sides{Vector::Constant(40, 0.25), Vector::Constant(40, 0.75)};
  const auto replaced = [&](double probability) -> Eigen::ArrayXd {
    const Matrix made = masked_candidates(random, centre, sides, 4000, probability);
    return (made.array() != 0.5).cast<double>().colwise().sum().transpose();
  };
  EXPECT_NEAR(replaced(0.5).mean(), 20, 0.25);  // five standard errors
  const Eigen::ArrayXd few = replaced(0.001);
  EXPECT_EQ(few.minCoeff(), 1);
  EXPECT_LT(few.mean(), 1.1);
}

TEST(AdamFit, FindsNoiseMeanAndTheAxisThatMatters) {
  relign::Random random(6);
  const Matrix points = surrogates::uniform_points(random, 3, 60);
  Vector values(60);
  for (Eigen::Index i = 0; i < 60; ++i) values[i] = 0.5 + std::sin(9 * points(1, i));
  const surrogates::Likelihood likelihood(surrogates::Shape::matern52, points, values);
  const Fitted fitted = adam_fit(likelihood, 3, 60);
  EXPECT_LT(fitted.theta[2], std::log(0.5));
  EXPECT_GT(fitted.theta[1], std::log(1.0));
  EXPECT_GT(fitted.theta[3], std::log(1.0));
  EXPECT_LT(fitted.theta[4], std::log(0.005));
  EXPECT_GT(fitted.mean, 0);
  Vector start = Vector::Constant(5, std::log(0.5));
  start[0] = 0;
  start[4] = std::log(0.005);
  EXPECT_GT(likelihood.log(fitted.theta, nullptr, fitted.mean), likelihood.log(start, nullptr) + 10);
}

TEST(TurboSearch, StartsWithALatinHypercubeOfTwicePointsPerAxis) {
  Search search(3, {}, 7);
  Matrix design(3, 6);
  for (auto point : design.colwise()) {
    point = search.ask();
    search.tell(point, 1);
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<int> slices;
    for (const double x : design.row(axis)) slices.push_back(static_cast<int>(6 * x));
    std::sort(slices.begin(), slices.end());
    EXPECT_EQ(slices, (std::vector<int>{0, 1, 2, 3, 4, 5}));
  }
  EXPECT_EQ(search.region().length(), 0.8) << "the design changes no region";
}

TEST(TurboSearch, StaysWithinTheRegionAroundTheBestPoint) {
  Search search(2, {}, 8);
  const auto merit = [](const Vector& x) { return (x - Vector::Constant(2, 0.3)).squaredNorm(); };
  Vector best;
  double lowest = std::numeric_limits<double>::infinity();
  double widest = 0;
  for (int step = 0; step < 40; ++step) {
    const double length = search.region().length();
    const Vector point = search.ask();
    // The scales of both axes are alike here: the sides differ by less than a factor of two.
    if (step >= 4 && length < 0.5) widest = std::max(widest, (point - best).lpNorm<Eigen::Infinity>() / length);
    const double value = merit(point);
    if (value < lowest) {
      lowest = value;
      best = point;
    }
    search.tell(point, value);
  }
  EXPECT_LT(lowest, 1e-3);
  EXPECT_GT(widest, 0);
  EXPECT_LT(widest, 1);
}

// Without any improvement the region halves at every fourth step: 4 + 28 steps until it collapses.
TEST(TurboSearch, RestartsWithANewDesignWhenTheRegionCollapses) {
  Search search(2, {0, 20, 80}, 9);
  std::vector<Vector> points;
  for (int step = 0; step < 4 + 28 + 4; ++step) {
    EXPECT_EQ(search.restarts(), step <= 32 ? 0u : 1u) << step;
    points.push_back(search.ask());
    search.tell(points.back(), step == 0 ? 0.5 : 1.0);
  }
  EXPECT_EQ(search.restarts(), 1u);
  EXPECT_EQ(search.region().length(), 0.8);
  EXPECT_NE(points[0], points[32]);
  // The new region does not remember the old one's best merit: 0.9 is a success, and the length doubles at the third.
  for (const double merit : {0.9, 0.8, 0.7}) search.tell(search.ask(), merit);
  EXPECT_EQ(search.region().length(), 1.6);
}

TEST(TurboSearch, CountsUnusableMeritsAsFailures) {
  Search search(1, {2, 10, 80}, 10);
  for (int step = 0; step < 2 + 4; ++step) search.tell(search.ask(), std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(search.region().length(), 0.4);
  for (const double merit : {3.0, 2.0, 1.0}) search.tell(search.ask(), merit);
  EXPECT_EQ(search.region().length(), 0.8);
}

}  // namespace
}  // namespace bo_turbo
