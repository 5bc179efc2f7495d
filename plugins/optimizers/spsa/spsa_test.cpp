#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "contract/run_on_bowl.h"

namespace relign {
namespace {

using test::FakeSetup;
using test::FakeTrial;
using test::off_centre_bowl;
using test::Pose;

void run(const FakeTrial& trial, const Json& parameters = {}) { test::run_plugin("spsa", "spsa", parameters, trial); }

FakeSetup setup_of(std::uint32_t axes, std::uint32_t budget, std::function<double(const Pose&)> merit) {
  FakeSetup setup;
  setup.axes = axes;
  setup.budget = budget;
  setup.merit = [merit](const Pose& pose, std::uint32_t) { return merit(pose); };
  return setup;
}

// Differences of a linear merit are exact, so perturbations and moves equal Spall's two sequences.
TEST(Spsa, FollowsSpallsGainSequences) {
  FakeTrial trial(setup_of(1, 100, [](const Pose& pose) { return 7 * pose[0]; }));
  run(trial, {{"perturbation", 0.01}, {"first_stride", 0.002}});
  ASSERT_EQ(trial.recommendations.size(), 50u);
  ASSERT_EQ(trial.steps.size(), 100u);
  double iterate = 0;
  for (std::size_t k = 0; k < 50; ++k) {
    const double c = 0.01 / std::pow(k + 1.0, 0.101);
    EXPECT_NEAR(std::fabs(trial.steps[2 * k].pose[0] - iterate), c, 1e-12);
    EXPECT_NEAR(trial.steps[2 * k].pose[0] + trial.steps[2 * k + 1].pose[0], 2 * iterate, 1e-12);
    const double next = trial.recommendations[k].pose[0];
    EXPECT_NEAR(iterate - next, 0.002 * std::pow(6.0 / (5.0 + k + 1.0), 0.602), 1e-12);  // A = 0.1 * 50
    iterate = next;
  }
}

// For a quadratic merit the expected difference equals the gradient. Compares the moves of every axis over seeds.
TEST(Spsa, MovesDownTheGradientOnAverage) {
  const auto merit = [](const Pose& pose) { return pose[0] + 0.5 * pose[1] - 0.25 * pose[2] + 3 * pose[0] * pose[1]; };
  double sum[3] = {};
  double square[3] = {};
  const int trials = 2000;
  for (int seed = 0; seed < trials; ++seed) {
    FakeSetup setup = setup_of(3, 2, merit);
    setup.seed = static_cast<std::uint64_t>(seed);
    FakeTrial trial(setup);
    run(trial);
    // The first pair gives an estimate per axis: its slope times the sign of the perturbation.
    const auto& high = trial.steps.at(0);
    const auto& low = trial.steps.at(1);
    const double slope = (high.merit - low.merit) / 0.2;
    const Pose& moved = trial.recommendations.at(0).pose;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double sign = high.pose[axis] > 0 ? 1 : -1;
      // The first slope defines the scale: the move is one stride, against the sign of the slope.
      EXPECT_NEAR(moved[axis], slope * sign > 0 ? -0.1 : 0.1, 1e-12);
      sum[axis] += slope * sign;
      square[axis] += slope * sign * slope * sign;
    }
  }
  const double gradient[3] = {1, 0.5, -0.25};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double mean = sum[axis] / trials;
    const double error = std::sqrt((square[axis] / trials - mean * mean) / trials);
    EXPECT_NEAR(mean, gradient[axis], 5 * error);
  }
}

TEST(Spsa, MinimisesQuadraticWithAndWithoutNoise) {
  for (const std::uint32_t axes : {1u, 2u, 5u, 10u})
    for (const double noise : {0.0, 0.005}) {
      SCOPED_TRACE(std::to_string(axes) + " axes, noise " + std::to_string(noise));
      FakeSetup setup = setup_of(axes, 1000, off_centre_bowl);
      setup.merit = [noise](const Pose& pose, std::uint32_t step) {
        Random random(99, step);
        return off_centre_bowl(pose) + noise * random.normal();
      };
      for (const char* recommend : {"iterate", "average"}) {
        FakeTrial trial(setup);
        run(trial, {{"recommend", recommend}});
        ASSERT_FALSE(trial.recommendations.empty());
        EXPECT_LT(off_centre_bowl(trial.recommendations.back().pose) - 0.01,
                  0.1 * (off_centre_bowl(Pose(axes, 0.0)) - 0.01));
      }
    }
}

TEST(Spsa, RecommendsIterateAfterEveryGradient) {
  for (const std::uint32_t gradients : {1u, 3u}) {
    FakeTrial trial(setup_of(5, 60, off_centre_bowl));
    run(trial, {{"gradients", gradients}});
    ASSERT_EQ(trial.recommendations.size(), 30u / gradients);
    for (std::size_t k = 0; k < trial.recommendations.size(); ++k)
      EXPECT_EQ(trial.recommendations[k].steps_made, 2 * gradients * (k + 1));
  }
}

TEST(Spsa, AverageIsMeanOfLateIterates) {
  FakeTrial plain(setup_of(3, 40, off_centre_bowl));
  run(plain);
  FakeTrial averaged(setup_of(3, 40, off_centre_bowl));
  run(averaged, {{"recommend", "average"}});
  ASSERT_EQ(plain.recommendations.size(), 20u);
  ASSERT_EQ(averaged.recommendations.size(), 20u);
  for (std::size_t k = 0; k < 10; ++k) EXPECT_EQ(averaged.recommendations[k].pose, plain.recommendations[k].pose);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double sum = 0;
    for (std::size_t k = 10; k < 20; ++k) sum += plain.recommendations[k].pose[axis];
    EXPECT_NEAR(averaged.recommendations.back().pose[axis], sum / 10, 1e-12);
  }
}

TEST(Spsa, StaysInTheBoxAndMeasuresBothSidesAtItsLimits) {
  FakeSetup setup = setup_of(3, 200, [](const Pose& pose) { return pose[0] - 20 * pose[1]; });
  setup.lower = {-0.1, -0.02, 0.3};
  setup.upper = {0.4, 0.02, 0.3};  // the third axis has no width
  setup.start = {0.9, -0.7, 0};
  FakeTrial trial(setup);
  run(trial);
  ASSERT_EQ(trial.steps.size(), 200u);
  for (std::size_t i = 0; i < 200; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_GE(trial.steps[i].pose[axis], setup.lower[axis]);
      EXPECT_LE(trial.steps[i].pose[axis], setup.upper[axis]);
      const bool apart = trial.steps[i].pose[axis] != trial.steps[i ^ 1].pose[axis];
      EXPECT_EQ(apart, axis < 2);
    }
  for (const auto& recommendation : trial.recommendations)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_GE(recommendation.pose[axis], setup.lower[axis]);
      EXPECT_LE(recommendation.pose[axis], setup.upper[axis]);
    }
  // The slope of the second axis dominates every difference: it moves to its limit and stays.
  EXPECT_EQ(trial.recommendations.back().pose[1], 0.02);
  EXPECT_EQ(trial.recommendations.back().pose[2], 0.3);
}

TEST(Spsa, NonFiniteMeritsDoNotMoveTheIterate) {
  FakeSetup setup = setup_of(2, 20, off_centre_bowl);
  setup.merit = [](const Pose& pose, std::uint32_t step) { return step % 2 ? off_centre_bowl(pose) : NAN; };
  FakeTrial trial(setup);
  run(trial);
  ASSERT_EQ(trial.recommendations.size(), 10u);
  for (const auto& recommendation : trial.recommendations) EXPECT_EQ(recommendation.pose, Pose(2, 0.0));
}

TEST(Spsa, MovesAreLimitedToFirstStride) {
  FakeSetup setup = setup_of(2, 200, off_centre_bowl);
  setup.merit = [](const Pose& pose, std::uint32_t step) {  // flat at first, then a cliff
    return step < 20 ? 1e-9 * pose[0] : 1e9 * pose[0] * (step % 4 < 2 ? 1 : -1);
  };
  FakeTrial trial(setup);
  run(trial, {{"first_stride", 0.05}});
  Pose before(2, 0.0);
  double longest = 0;
  for (const auto& recommendation : trial.recommendations) {
    for (std::size_t axis = 0; axis < 2; ++axis)
      longest = std::max(longest, std::fabs(recommendation.pose[axis] - before[axis]));
    before = recommendation.pose;
  }
  EXPECT_NEAR(longest, 0.05, 1e-12);
}

}  // namespace
}  // namespace relign
