#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "contract/run_plugin.h"

namespace relign::bo_turbo_tests {
namespace {

using test::FakeSetup;
using test::FakeTrial;
using test::Pose;

void run(const FakeTrial& trial, const Json& parameters = {}) {
  test::run_plugin("bo_turbo", "bo-turbo", parameters, trial);
}

double ackley(const Pose& x) {
  double squares = 0, waves = 0;
  for (const double v : x) {
    squares += v * v;
    waves += std::cos(2 * std::acos(-1.0) * v);
  }
  const auto n = static_cast<double>(x.size());
  return 20 - 20 * std::exp(-0.2 * std::sqrt(squares / n)) + std::exp(1.0) - std::exp(waves / n);
}

double rosenbrock(const Pose& x) {
  double sum = 0;
  for (std::size_t i = 0; i + 1 < x.size(); ++i)
    sum += 100 * std::pow(x[i + 1] - x[i] * x[i], 2) + std::pow(1 - x[i], 2);
  return sum;
}

// Mean of the lowest merit over the seeds. The start has no value, as in the published runs.
double mean_best(double (*function)(const Pose&), std::uint32_t axes, double lower, double upper, std::uint32_t budget,
                 std::uint64_t seeds, bool random = false) {
  FakeSetup setup;
  setup.axes = axes;
  setup.lower = Pose(axes, lower);
  setup.upper = Pose(axes, upper);
  setup.budget = budget;
  setup.merit = [&](const Pose& pose, std::uint32_t step) {
    return step == 0 ? std::numeric_limits<double>::quiet_NaN() : function(pose);
  };
  double sum = 0, squares = 0;
  for (setup.seed = 1; setup.seed <= seeds; ++setup.seed) {
    FakeTrial trial(setup);
    if (random)
      test::run_plugin("random", "random", {}, trial);
    else
      run(trial, {{"use_start", false}});
    double best = std::numeric_limits<double>::infinity();
    for (const auto& visit : trial.steps) best = std::min(best, visit.merit);
    sum += best;
    squares += best * best;
  }
  const double n = static_cast<double>(seeds), mean = sum / n;
  std::printf("  %-8s %u axes, %u steps: %.4g +- %.2g (standard error, %d seeds)\n", random ? "random" : "bo-turbo",
              axes, budget, mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / std::max(1.0, n - 1)),
              static_cast<int>(seeds));
  return mean;
}

// With RELIGN_FULL=1 ten seeds, compared with another implementation in README.md.
TEST(BoTurbo, FindsTheMinimaOfAckleyAndRosenbrock) {
  const std::uint64_t seeds = std::getenv("RELIGN_FULL") ? 10 : 2;
  EXPECT_LT(mean_best(ackley, 6, -5, 10, 60, seeds), 0.5 * mean_best(ackley, 6, -5, 10, 60, 10, true));
  EXPECT_LT(mean_best(rosenbrock, 6, -5, 10, 60, seeds), 0.1 * mean_best(rosenbrock, 6, -5, 10, 60, 10, true));
}

FakeSetup noisy_bowl(std::uint32_t axes) {
  FakeSetup setup;
  setup.axes = axes;
  setup.budget = 35;
  setup.merit = [=](const Pose& pose, std::uint32_t step) {
    return test::bowl(pose, Pose(axes, 0.2)) + 0.05 * Random(99, step).normal();
  };
  return setup;
}

TEST(BoTurbo, LeavesTheRecommendationToTheBestMeasuredPose) {
  FakeTrial trial(noisy_bowl(5));
  run(trial);
  EXPECT_EQ(trial.steps.size(), 35u);
  EXPECT_TRUE(trial.recommendations.empty());
}

// The design is the same in both cases; the first proposal of the model depends on the start.
TEST(BoTurbo, UsesStartInTheFirstModelOnly) {
  std::vector<Pose> poses[2];
  for (const bool use_start : {false, true}) {
    FakeSetup setup = noisy_bowl(3);
    setup.budget = 7;
    FakeTrial trial(setup);
    run(trial, {{"use_start", use_start}});
    for (const auto& visit : trial.steps) poses[use_start].push_back(visit.pose);
  }
  ASSERT_EQ(poses[0].size(), 7u);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(poses[0][i], poses[1][i]);
  EXPECT_NE(poses[0][6], poses[1][6]);
}

TEST(BoTurbo, AcceptsNonFiniteAndConstantMerits) {
  const double infinity = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const std::uint32_t axes : {1u, 4u, 10u})
    for (const int kind : {0, 1, 2, 3, 4}) {
      SCOPED_TRACE(std::to_string(axes) + " axes, merits " + std::to_string(kind));
      FakeSetup setup = noisy_bowl(axes);
      setup.merit = [=](const Pose& pose, std::uint32_t step) {
        const double usual = test::bowl(pose, Pose(axes, 0.2));
        const double merits[] = {0.03, nan, step % 3 ? usual : nan, step % 3 ? usual : infinity,
                                 step % 3 ? usual : 1e300};
        return merits[kind];
      };
      FakeTrial trial(setup);
      run(trial, {{"candidates", 50}});
      EXPECT_EQ(trial.steps.size(), 35u);
      EXPECT_FALSE(trial.refused);
      EXPECT_EQ(trial.requests_after_stop, 0u);
    }
}

TEST(BoTurbo, RefitsSeldomInLongTrials) {
  FakeSetup setup = noisy_bowl(2);
  setup.budget = 100;
  FakeTrial trial(setup);
  run(trial, {{"exact_points", 5}, {"candidates", 50}});
  ASSERT_EQ(trial.steps.size(), 100u);
  EXPECT_LT(test::bowl(trial.best_pose(), Pose(2, 0.2)), 0.01 + 0.05);
}

TEST(BoTurbo, AcceptsBoxWithoutWidthAlongAnAxis) {
  FakeSetup setup = noisy_bowl(2);
  setup.lower = {0.1, -0.5};
  setup.upper = {0.1, 0.5};
  setup.budget = 15;
  FakeTrial trial(setup);
  run(trial);
  ASSERT_EQ(trial.steps.size(), 15u);
  for (const auto& visit : trial.steps) EXPECT_EQ(visit.pose[0], 0.1);
}

TEST(BoTurbo, RejectsBadParameters) {
  const FakeTrial trial(noisy_bowl(2));
  for (const Json& bad : {Json{{"initial_points", -1}}, Json{{"candidates", 5001}}, Json{{"exact_points", 0}},
                          Json{{"use_start", 2}}, Json{{"kappa", 1}}})
    EXPECT_ANY_THROW(run(trial, bad)) << bad;
  EXPECT_TRUE(trial.steps.empty()) << "refused before a trial";
}

}  // namespace
}  // namespace relign::bo_turbo_tests
