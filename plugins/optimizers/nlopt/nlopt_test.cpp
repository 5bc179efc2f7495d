#include "nlopt_test.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"

namespace relign::nlopt_tests {
namespace {

using test::bowl_setup;
using test::FakeSetup;
using test::FakeTrial;
using test::nlopt_local_presets;
using test::nlopt_presets;
using test::Pose;
using test::run_nlopt;

TEST(Nlopt, MinimisesQuadraticInAnyDimension) {
  for (const std::string& id : nlopt_local_presets)
    for (const std::uint32_t axes : {1u, 2u, 5u, 6u}) {
      SCOPED_TRACE(id + ", " + std::to_string(axes) + " axes");
      FakeSetup setup = bowl_setup(axes);
      setup.budget = 400;
      FakeTrial trial(setup);
      run_nlopt(id, trial);
      EXPECT_LT(setup.merit(trial.best_pose(), 0), 0.01 + 5e-5);
    }
}

TEST(Nlopt, RecommendsEveryImprovement) {
  for (const std::string& id : nlopt_presets()) {
    SCOPED_TRACE(id);
    FakeTrial trial(bowl_setup(5));
    run_nlopt(id, trial);
    double best = trial.setup.merit(trial.setup.start, 0);
    std::vector<Pose> expected;
    for (const auto& visit : trial.steps)
      if (visit.merit < best) {
        best = visit.merit;
        expected.push_back(visit.pose);
      }
    ASSERT_EQ(trial.recommendations.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(trial.recommendations[i].pose, expected[i]);
  }
}

TEST(Nlopt, DoesNotMeasureStartAgain) {
  for (const std::string& id : nlopt_presets()) {
    SCOPED_TRACE(id);
    FakeSetup setup = bowl_setup(5);
    setup.budget = 1;
    FakeTrial trial(setup);
    run_nlopt(id, trial);
    ASSERT_EQ(trial.steps.size(), 1u);
    EXPECT_NE(trial.steps[0].pose, setup.start);
  }
}

TEST(Nlopt, ClampsStartToTheBox) {
  for (const std::string& id : nlopt_presets()) {
    SCOPED_TRACE(id);
    FakeSetup setup = bowl_setup(3);
    setup.start = {0.9, -0.7, 0};
    FakeTrial trial(setup);
    run_nlopt(id, trial);
    for (const auto& visit : trial.steps)
      for (const double value : visit.pose) {
        EXPECT_GE(value, -0.5);
        EXPECT_LE(value, 0.5);
      }
    EXPECT_LT(setup.merit(trial.best_pose(), 0), 0.35);  // 0.7 at the nearest corner
  }
}

TEST(Nlopt, RestartsUntilStrideIsBelowTolerance) {
  for (const std::string& id : nlopt_local_presets) {
    SCOPED_TRACE(id);
    FakeSetup setup = bowl_setup(2);
    setup.budget = 100000;
    FakeTrial coarse(setup);
    run_nlopt(id, coarse, {{"tolerance", 0.05}});
    FakeTrial fine(setup);
    run_nlopt(id, fine, {{"tolerance", 0.0001}});
    EXPECT_FALSE(coarse.stopped);
    EXPECT_FALSE(fine.stopped);
    EXPECT_LT(coarse.steps.size(), fine.steps.size());
    EXPECT_LT(fine.steps.size(), 5000u);
  }
}

TEST(Nlopt, LocalMethodsFinishOnConstantMerits) {
  for (const std::string& id : nlopt_local_presets)
    for (const std::uint32_t axes : {1u, 2u, 5u, 6u}) {
      SCOPED_TRACE(id + ", " + std::to_string(axes) + " axes");
      FakeSetup setup = bowl_setup(axes);
      setup.merit = [](const Pose&, std::uint32_t) { return 0.03; };
      setup.budget = 1000000;
      FakeTrial trial(setup);
      run_nlopt(id, trial);
      EXPECT_FALSE(trial.stopped);
      EXPECT_TRUE(trial.recommendations.empty());
      EXPECT_LT(trial.steps.size(), 20000u);
    }
}

TEST(Nlopt, FirstMoveHasLengthOfFirstStride) {
  for (const std::string& id : nlopt_local_presets) {
    SCOPED_TRACE(id);
    FakeSetup setup = bowl_setup(5);
    setup.budget = 1;
    FakeTrial trial(setup);
    run_nlopt(id, trial, {{"first_stride", 0.04}});
    double length = 0;
    for (const double value : trial.steps.at(0).pose) length += value * value;
    EXPECT_NEAR(std::sqrt(length), 0.04, 1e-9);
  }
}

TEST(Nlopt, PropagatesFailureOfTheHost) {
  for (const std::string& id : nlopt_presets()) {
    SCOPED_TRACE(id);
    FakeSetup setup = bowl_setup(5);
    setup.merit = [](const Pose&, std::uint32_t step) -> double {
      if (step == 7) throw Error(ErrorKind::plugin_failed, "the scene is broken");
      return 1.0 / (1 + step);
    };
    FakeTrial trial(setup);
    try {
      run_nlopt(id, trial);
      FAIL() << "no exception";
    } catch (const Error& error) {
      EXPECT_STREQ(error.what(), "the scene is broken");
    }
    EXPECT_EQ(trial.steps.size(), 6u);
  }
}

}  // namespace
}  // namespace relign::nlopt_tests
