#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "contract/run_on_bowl.h"

namespace relign::scan {
namespace {

using test::bowl_setup;
using test::FakeSetup;
using test::FakeTrial;
using test::Pose;

void run(const FakeTrial& trial, const std::string& id, const Json& parameters = {}) {
  test::run_plugin("scan", id, parameters, trial);
}

// Results of the package relign 0.1.0 on the same function. For three axes, where the package rounds the cube root of
// 64 down to 3, the number of points is given.
TEST(Scan, PackagePresetMatchesPackage) {
  struct Case {
    std::uint32_t axes, budget, points, captures;
    Pose best;
    double merit;
  };
  const Case cases[] = {{1, 10, 0, 10, {1 / 6.0}, 0.010011111111111111},
                        {2, 49, 0, 49, {1 / 6.0, -1 / 6.0}, 0.012699277777777773},
                        {3, 64, 3, 27, {0, 0, 0}, 0.09971949999999999},
                        {5, 50, 0, 32, {0.5, -0.5, 0.5, -0.5, 0.5}, 0.5600689999999999}};
  for (const Case& given : cases) {
    SCOPED_TRACE(given.axes);
    FakeTrial trial(bowl_setup(given.axes, given.budget));
    run(trial, "scan-package", {{"points", given.points}});
    EXPECT_EQ(trial.steps.size(), given.captures);
    ASSERT_FALSE(trial.recommendations.empty());
    const Pose& best = trial.recommendations.back().pose;
    for (std::size_t axis = 0; axis < given.axes; ++axis) EXPECT_NEAR(best[axis], given.best[axis], 1e-15);
    EXPECT_NEAR(trial.setup.merit(best, 0), given.merit, 1e-14);
  }
}

TEST(Scan, PackagePresetScansRowsFromLimitToLimit) {
  FakeSetup setup = bowl_setup(2, 6);
  setup.lower = {-1, 2};
  setup.upper = {1, 4};
  setup.start = {0, 3};
  FakeTrial trial(setup);
  run(trial, "scan-package", {{"points", 3}});
  const std::vector<Pose> expected = {{-1, 2}, {-1, 3}, {-1, 4}, {0, 2}, {0, 3}, {0, 4}};
  ASSERT_EQ(trial.steps.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(trial.steps[i].pose, expected[i]);
  EXPECT_TRUE(trial.stopped);
}

TEST(Scan, EveryOrderVisitsEveryPointOnce) {
  for (const char* order : {"rows", "coarse-first"})
    for (const std::uint32_t axes : {1u, 2u, 3u})
      for (const std::uint32_t points : {1u, 2u, 3u, 4u, 6u, 9u}) {
        SCOPED_TRACE(std::string(order) + ", " + std::to_string(axes) + " axes, " + std::to_string(points));
        FakeTrial trial(bowl_setup(axes, 100000));
        run(trial, "scan", {{"points", points}, {"order", order}});
        std::set<Pose> distinct;
        for (const auto& visit : trial.steps) {
          distinct.insert(visit.pose);
          for (const double value : visit.pose) {  // centres of the cells
            const double index = (value + 0.5) * points - 0.5;
            EXPECT_NEAR(index, std::round(index), 1e-12);
          }
        }
        const auto all = static_cast<std::size_t>(std::lround(std::pow(points, axes)));
        EXPECT_EQ(trial.steps.size(), all);
        EXPECT_EQ(distinct.size(), all);
        EXPECT_FALSE(trial.stopped);
      }
}

// At any time no gap is more than twice as wide as another one.
TEST(Scan, VisitsCoarsePointsFirst) {
  FakeTrial trial(bowl_setup(1, 100));
  run(trial, "scan", {{"points", 9}, {"placement", "ends"}});
  const std::vector<double> expected = {0, -0.5, 0.5, -0.25, 0.25, -0.375, -0.125, 0.125, 0.375};
  ASSERT_EQ(trial.steps.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(trial.steps[i].pose[0], expected[i]);
  FakeTrial plane(bowl_setup(2, 9));
  run(plane, "scan", {{"points", 5}, {"placement", "ends"}});
  for (const auto& visit : plane.steps)
    for (const double value : visit.pose) EXPECT_TRUE(value == 0 || std::fabs(value) == 0.5) << value;
}

TEST(Scan, UsesLargestGridWithinBudget) {
  struct Case {
    std::uint32_t axes, budget, captures;
  };
  // A floating-point root is wrong for 125 and 64.
  for (const Case& given : {Case{3, 125, 125}, Case{3, 124, 64}, Case{3, 64, 64}, Case{5, 242, 32}, Case{5, 243, 243},
                            Case{10, 1, 1}, Case{1, 7, 7}}) {
    SCOPED_TRACE(std::to_string(given.axes) + " axes, " + std::to_string(given.budget));
    FakeTrial trial(bowl_setup(given.axes, given.budget));
    run(trial, "scan");
    EXPECT_EQ(trial.steps.size(), given.captures);
    EXPECT_FALSE(trial.stopped);
  }
}

TEST(Scan, RecommendsBestFiniteMerit) {
  FakeSetup setup = bowl_setup(2, 9);
  setup.start = {0.1, 0};
  const auto merits = std::vector<double>{5, 7, NAN, -INFINITY, 4, 4, 3, INFINITY, 6, 8};
  setup.merit = [merits](const Pose&, std::uint32_t step) { return merits[step]; };
  FakeTrial trial(setup);
  run(trial, "scan");
  std::vector<std::size_t> made;
  for (const auto& recommendation : trial.recommendations) made.push_back(recommendation.steps_made);
  EXPECT_EQ(made, (std::vector<std::size_t>{0, 4, 6}));
  FakeTrial without(setup);
  run(without, "scan-package", {{"points", 3}});
  ASSERT_FALSE(without.recommendations.empty());
  EXPECT_EQ(without.recommendations.front().steps_made, 1u);
}

}  // namespace
}  // namespace relign::scan
