#include <gtest/gtest.h>

#include <cmath>

#include "contract/run_on_bowl.h"

namespace relign::coordinate_walk {
namespace {

using test::bowl_setup;
using test::FakeSetup;
using test::FakeTrial;
using test::Pose;

void run(const FakeTrial& trial, const Json& parameters = {}, const std::string& id = "coordinate-walk") {
  test::run_plugin("coordinate_walk", id, parameters, trial);
}

TEST(CoordinateWalk, StartsAtRandomGridPoint) {
  std::vector<Pose> begins;
  for (const std::uint64_t seed : {1u, 2u}) {
    FakeSetup setup = bowl_setup(10, 1);
    setup.seed = seed;
    FakeTrial trial(setup);
    run(trial, {{"points", 5}});
    begins.push_back(trial.steps.at(0).pose);
    EXPECT_EQ(begins.back()[0], -0.5);  // the first sweep's first point
    for (const double value : begins.back()) EXPECT_EQ(value * 4, std::round(value * 4));
  }
  EXPECT_NE(begins[0], begins[1]);
}

// Results of the package relign 0.1.0 with the grid indices drawn from our seed.
TEST(CoordinateWalk, MatchesPackage) {
  struct Case {
    std::uint32_t axes, budget, rounds;
    Pose end;
    double last_merit;
    double sum_of_merits;  // summarises all steps
  };
  const Case cases[] = {
      {3, 42, 2, {1 / 6.0, -1 / 6.0, 1 / 6.0}, 0.24799727777777775, 16.24517455555555},
      {5, 50, 1, {-1 / 6.0, -1 / 6.0, -1 / 18.0, -1 / 18.0, 1 / 6.0}, 0.6623986296296296, 49.703363580246915}};
  for (const Case& given : cases) {
    SCOPED_TRACE(given.axes);
    FakeTrial trial(bowl_setup(given.axes, given.budget));
    run(trial, {{"rounds", given.rounds}});
    ASSERT_EQ(trial.steps.size(), given.budget);
    double sum = 0;
    for (const auto& visit : trial.steps) sum += visit.merit;
    EXPECT_NEAR(sum, given.sum_of_merits, 1e-12);
    EXPECT_NEAR(trial.steps.back().merit, given.last_merit, 1e-13);
    for (std::size_t axis = 0; axis < given.axes; ++axis)
      EXPECT_NEAR(trial.recommendations.back().pose[axis], given.end[axis], 1e-15);
  }
}

TEST(CoordinateWalk, SweepsAxisByAxisAndRecommendsBestOfEachSweep) {
  FakeSetup setup = bowl_setup(3, 50);
  FakeTrial trial(setup);
  run(trial, {{"points", 5}, {"rounds", 2}});
  ASSERT_EQ(trial.steps.size(), 30u);
  ASSERT_EQ(trial.recommendations.size(), 6u);
  EXPECT_FALSE(trial.stopped);
  for (std::size_t sweep = 0; sweep < 6; ++sweep) {
    std::size_t best = 5 * sweep;
    for (std::size_t i = 5 * sweep; i < 5 * sweep + 5; ++i) {
      const Pose& pose = trial.steps[i].pose;
      EXPECT_EQ(pose[sweep % 3], -0.5 + 0.25 * static_cast<double>(i % 5));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (axis == sweep % 3 || sweep == 0) continue;
        EXPECT_EQ(pose[axis], trial.recommendations[sweep - 1].pose[axis]);
      }
      if (trial.steps[i].merit < trial.steps[best].merit) best = i;
    }
    EXPECT_EQ(trial.recommendations[sweep].pose, trial.steps[best].pose);
    EXPECT_EQ(trial.recommendations[sweep].steps_made, 5 * sweep + 5);
  }
}

TEST(CoordinateWalk, DerivesPointsFromBudget) {
  struct Case {
    std::uint32_t axes, budget, rounds, captures;
  };
  for (const Case& given : {Case{5, 50, 1, 50}, Case{5, 54, 1, 50}, Case{3, 42, 2, 42}, Case{4, 3, 1, 3},
                            Case{1, 1, 1, 1}, Case{2, 5, 3, 5}}) {
    SCOPED_TRACE(std::to_string(given.axes) + " axes, " + std::to_string(given.budget));
    FakeTrial trial(bowl_setup(given.axes, given.budget));
    run(trial, {{"rounds", given.rounds}});
    EXPECT_EQ(trial.steps.size(), given.captures);
  }
}

TEST(CoordinateWalk, ParabolaMinimisesSeparableQuadraticInOneRound) {
  for (const std::uint32_t points : {3u, 4u, 9u}) {
    FakeSetup setup = bowl_setup(4, 100);
    setup.merit = [](const Pose& pose, std::uint32_t) {
      double sum = 3;
      for (std::size_t axis = 0; axis < pose.size(); ++axis) {
        const double away = pose[axis] - 0.1 * static_cast<double>(axis);
        sum += (1 + static_cast<double>(axis)) * away * away;
      }
      return sum;
    };
    FakeTrial trial(setup);
    run(trial, {{"points", points}, {"choose", "parabola"}});
    ASSERT_EQ(trial.recommendations.size(), 4u);
    for (std::size_t axis = 0; axis < 4; ++axis)
      EXPECT_NEAR(trial.recommendations.back().pose[axis], 0.1 * static_cast<double>(axis), 1e-12);
  }
}

TEST(CoordinateWalk, ParabolaResultStaysWithinTheSweep) {
  FakeSetup hill = bowl_setup(1, 5);
  hill.merit = [](const Pose& pose, std::uint32_t) { return 1 - (pose[0] - 0.1) * (pose[0] - 0.1); };
  FakeTrial on_a_hill(hill);
  run(on_a_hill, {{"choose", "parabola"}});
  EXPECT_EQ(on_a_hill.recommendations.at(0).pose[0], -0.5);  // the lowest measured merit
  FakeSetup slope = bowl_setup(1, 5);
  slope.merit = [](const Pose& pose, std::uint32_t) { return (pose[0] - 0.9) * (pose[0] - 0.9); };
  FakeTrial on_a_slope(slope);
  run(on_a_slope, {{"choose", "parabola"}});
  EXPECT_EQ(on_a_slope.recommendations.at(0).pose[0], 0.5);
}

TEST(CoordinateWalk, LaterRoundsShrinkAroundThePose) {
  FakeSetup setup = bowl_setup(2, 100);
  setup.merit = [](const Pose& pose, std::uint32_t) { return std::fabs(pose[0] - 0.5) + std::fabs(pose[1]); };
  FakeTrial trial(setup);
  run(trial, {{"points", 5}, {"rounds", 2}, {"shrink", 0.5}});
  ASSERT_EQ(trial.steps.size(), 20u);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(trial.steps[10 + i].pose[0], 0.125 * static_cast<double>(i));  // shifted into the box as a whole
    EXPECT_EQ(trial.steps[15 + i].pose[1], -0.25 + 0.125 * static_cast<double>(i));
  }
}

TEST(CoordinateWalk, IgnoresNonFiniteMerits) {
  FakeSetup setup = bowl_setup(2, 8);
  const auto merits = std::vector<double>{1, NAN, 4, -INFINITY, 5, NAN, NAN, INFINITY, NAN};
  setup.merit = [merits](const Pose&, std::uint32_t step) { return merits[step]; };
  FakeTrial trial(setup);
  run(trial, {{"points", 4}, {"begin", "start"}});
  ASSERT_EQ(trial.recommendations.size(), 1u);  // the second sweep has no finite merit
  EXPECT_EQ(trial.recommendations[0].pose, trial.steps[1].pose);
}

TEST(CoordinateWalk, RejectsOnePoint) {
  FakeTrial trial(bowl_setup(2, 8));
  try {
    run(trial, {{"points", 1}});
    FAIL() << "no exception";
  } catch (const std::exception& error) {
    EXPECT_NE(std::string(error.what()).find("must be 0 (from the budget) or at least 2"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace relign::coordinate_walk
