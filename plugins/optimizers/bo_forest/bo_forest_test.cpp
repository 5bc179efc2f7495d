#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>

#include "base/error.h"
#include "contract/fake_trial.h"
#include "plugin_host/objects.h"

namespace relign::bo_forest_tests {
namespace {

using plugin_host::Algorithm;
using plugin_host::Kind;
using test::FakeSetup;
using test::FakeTrial;
using test::Pose;

const double kNaN = std::numeric_limits<double>::quiet_NaN();

plugin_host::Catalog& catalog() {
  static auto* catalog = [] {
    auto* fresh = new plugin_host::Catalog;
    fresh->add(std::string(RELIGN_PLUGIN_DIR) + "/bo_forest");
    return fresh;
  }();
  return *catalog;
}

void run(const std::string& id, const FakeTrial& trial, const Json& parameters = {}) {
  Algorithm algorithm(catalog().resolve_or_throw(Kind::optimizer, id, parameters), {});
  algorithm.run(trial.handle());
}

FakeSetup branin() {
  FakeSetup setup;
  setup.axes = 2;
  setup.lower = {-5, 0};
  setup.upper = {10, 15};
  setup.merit = [](const Pose& x, std::uint32_t step) {
    if (step == 0) return kNaN;  // the published runs have no value at the start
    const double bend = x[1] - 5.1 / (4 * M_PI * M_PI) * x[0] * x[0] + 5 / M_PI * x[0] - 6;
    return bend * bend + 10 * (1 - 1 / (8 * M_PI)) * std::cos(x[0]) + 10;
  };
  return setup;
}

FakeSetup hartmann6() {
  FakeSetup setup;
  setup.axes = 6;
  setup.lower.assign(6, 0);
  setup.upper.assign(6, 1);
  setup.merit = [](const Pose& x, std::uint32_t step) {
    static const double height[4] = {1, 1.2, 3, 3.2};
    static const double steep[4][6] = {
        {10, 3, 17, 3.5, 1.7, 8}, {0.05, 10, 17, 0.1, 8, 14}, {3, 3.5, 1.7, 10, 17, 8}, {17, 8, 0.05, 10, 0.1, 14}};
    static const double place[4][6] = {{0.1312, 0.1696, 0.5569, 0.0124, 0.8283, 0.5886},
                                       {0.2329, 0.4135, 0.8307, 0.3736, 0.1004, 0.9991},
                                       {0.2348, 0.1451, 0.3522, 0.2883, 0.3047, 0.6650},
                                       {0.4047, 0.8828, 0.8732, 0.5743, 0.1091, 0.0381}};
    if (step == 0) return kNaN;
    double sum = 0;
    for (int peak = 0; peak < 4; ++peak) {
      double away = 0;
      for (int axis = 0; axis < 6; ++axis) away += steep[peak][axis] * std::pow(x[axis] - place[peak][axis], 2);
      sum -= height[peak] * std::exp(-away);
    }
    return sum;
  };
  return setup;
}

// Mean over seeds of the lowest of `calls` values.
double mean_best(const std::string& id, FakeSetup setup, unsigned calls, unsigned seeds) {
  double sum = 0;
  setup.budget = calls;
  for (unsigned seed = 0; seed < seeds; ++seed) {
    setup.seed = seed;
    FakeTrial trial(setup);
    run(id, trial);
    double best = std::numeric_limits<double>::infinity();
    for (const auto& visit : trial.steps) best = std::min(best, visit.merit);
    sum += best;
  }
  return sum / seeds;
}

// The published runs have 200 calls and ten seeds, which takes minutes: RELIGN_FULL=1, results in README.md.
bool full() { return std::getenv("RELIGN_FULL") != nullptr; }

void expect_mean_best(const FakeSetup& setup, const std::string& id, unsigned calls, unsigned seeds, double gate) {
  const double found = mean_best(id, setup, calls, seeds);
  EXPECT_LE(found, gate) << id;
  std::cout << id << ": mean of the lowest of " << calls << " values " << found << "\n";
}

TEST(BoForest, MatchesPublishedResultsOnHartmann6) {
  expect_mean_best(hartmann6(), "bo-et", full() ? 200 : 100, full() ? 10 : 2, full() ? -3.10 : -2.9);
  expect_mean_best(hartmann6(), "bo-rf", full() ? 200 : 100, full() ? 10 : 2, full() ? -3.03 : -2.9);
}  // random search reaches -2.74 (mean of two seeds, 100 calls) in 1 % of cases

TEST(BoForest, MatchesPublishedResultsOnBranin) {
  if (!full())
    GTEST_SKIP() << "random search comes close to the limit: only the means of RELIGN_FULL=1 are significant";
  expect_mean_best(branin(), "bo-et", 200, 10, 0.62);
  expect_mean_best(branin(), "bo-rf", 200, 10, 0.911);  // no published value for RF: compares with random search
}

std::vector<Pose> poses(const std::string& id, const FakeSetup& setup, const Json& parameters = {}) {
  FakeTrial trial(setup);
  run(id, trial, parameters);
  EXPECT_TRUE(trial.stopped);
  std::vector<Pose> poses;
  for (const auto& visit : trial.steps) poses.push_back(visit.pose);
  return poses;
}

std::vector<Pose> head(std::vector<Pose> poses, std::size_t count) {
  poses.resize(count);
  return poses;
}

TEST(BoForest, ParametersChangeOnlyStepsAfterInitialPoints) {
  FakeSetup setup = hartmann6();
  setup.budget = 30;
  const auto usual = poses("bo-rf", setup);
  for (const Json& choice : {Json{{"splitter", "random"}}, Json{{"bootstrap", false}}, Json{{"variance", "between"}},
                             Json{{"trees", 10}}, Json{{"min_samples_leaf", 1}}, Json{{"candidates", 100}},
                             Json{{"xi", 0.5}}, Json{{"min_variance", 0.5}}, Json{{"relative_xi", true}, {"xi", 1}}}) {
    SCOPED_TRACE(choice.dump());
    const auto changed = poses("bo-rf", setup, choice);
    EXPECT_NE(changed, usual);
    EXPECT_EQ(head(changed, 10), head(usual, 10));
  }
  EXPECT_EQ(poses("bo-et", setup), poses("bo-rf", setup, {{"splitter", "random"}, {"bootstrap", false}}));
}

// Scaled by a power of two, because rounding decides between axes that split samples in the same way.
TEST(BoForest, IsIndependentOfUnitOfMerit) {
  for (const std::string id : {"bo-rf", "bo-et"}) {
    FakeSetup setup = hartmann6();
    setup.budget = 20;
    const auto usual = poses(id, setup, {{"xi", 0.25}});
    const auto merit = setup.merit;
    setup.merit = [merit](const Pose& pose, std::uint32_t step) { return 1048576 * merit(pose, step); };
    EXPECT_EQ(poses(id, setup, {{"xi", 262144}}), usual);
    EXPECT_NE(poses(id, setup, {{"xi", 0.25}}), usual);
  }
}

TEST(BoForest, IgnoresStartOutsideTheBox) {
  FakeSetup setup;
  setup.axes = 2;
  setup.budget = 30;
  double at_start = 0.5;
  setup.merit = [&](const Pose& pose, std::uint32_t step) { return step ? test::bowl(pose, {0.2, -0.1}) : at_start; };
  const auto inside = poses("bo-rf", setup);
  at_start = 0;
  EXPECT_NE(poses("bo-rf", setup), inside);
  setup.start = {0.7, 0};
  const auto outside = poses("bo-rf", setup);
  at_start = 0.5;
  EXPECT_EQ(poses("bo-rf", setup), outside);
}

// Merits are not finite in one half of the box: the search stays in the other one.
TEST(BoForest, AvoidsNonFiniteMerits) {
  for (const std::string id : {"bo-rf", "bo-et"}) {
    FakeSetup setup;
    setup.axes = 2;
    setup.budget = 60;
    setup.merit = [](const Pose& pose, std::uint32_t) { return pose[0] > 0 ? kNaN : 1 + pose[1] * pose[1]; };
    unsigned broken = 0;
    const auto visited = poses(id, setup);
    for (std::size_t step = 20; step < visited.size(); ++step) broken += visited[step][0] > 0;
    EXPECT_LT(broken, 8u) << id;  // of 40; random search: 20
  }
}

// One pose in a hundred has an outlier merit far from the minimum, which must not be recommended.
TEST(BoForest, RecommendationIsRobustToOutliers) {
  for (const std::string id : {"bo-rf", "bo-et"}) {
    FakeSetup setup;
    setup.axes = 2;
    setup.budget = 60;
    const Pose valley{0.2, -0.1};
    setup.merit = [&](const Pose& pose, std::uint32_t step) { return step == 5 ? 0 : test::bowl(pose, valley); };
    FakeTrial trial(setup);
    run(id, trial);
    ASSERT_EQ(trial.recommendations.size(), 51u);  // one per step after the initial points
    for (const auto& recommended : trial.recommendations) {
      const auto is_it = [&](const auto& visit) { return visit.pose == recommended.pose; };
      EXPECT_TRUE(std::any_of(trial.steps.begin(), trial.steps.end(), is_it) || recommended.pose == trial.setup.start);
    }
    const double lucky = test::bowl(trial.steps[4].pose, valley);
    EXPECT_EQ(trial.best_pose(), trial.steps[4].pose);
    EXPECT_LT(test::bowl(trial.recommendations.back().pose, valley), 0.5 * lucky) << id;
  }
}

TEST(BoForest, RejectsBadParametersByName) {
  for (const char* name : {"trees", "min_samples_leaf", "initial_points", "candidates"}) {
    try {
      catalog().resolve_or_throw(Kind::optimizer, "bo-forest", {{name, 0}});
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace relign::bo_forest_tests
