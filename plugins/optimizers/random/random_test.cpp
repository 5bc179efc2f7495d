#include <gtest/gtest.h>

#include <cmath>

#include "contract/fake_trial.h"
#include "plugin_host/objects.h"

namespace relign {
namespace {

TEST(RandomSearch, IsUniformInTheBoxWithoutRecommendations) {
  plugin_host::Catalog catalog;
  catalog.add(std::string(RELIGN_PLUGIN_DIR) + "/random");
  test::FakeSetup setup;
  setup.axes = 3;
  setup.lower = {0.2, -0.5, 2};
  setup.upper = {0.8, 0.5, 6};
  setup.start = {0.5, 0, 3};
  setup.budget = 20000;
  setup.seed = 5;
  setup.merit = [](const test::Pose& pose, std::uint32_t) { return pose[0]; };
  test::FakeTrial trial(setup);
  plugin_host::Algorithm algorithm(catalog.resolve_or_throw(plugin_host::Kind::optimizer, "random"), {});
  algorithm.run(trial.handle());
  ASSERT_EQ(trial.steps.size(), setup.budget);
  EXPECT_TRUE(trial.stopped);
  EXPECT_TRUE(trial.recommendations.empty());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double sum = 0;
    double squares = 0;
    for (const auto& visit : trial.steps) {
      const double share = (visit.pose[axis] - setup.lower[axis]) / (setup.upper[axis] - setup.lower[axis]);
      ASSERT_GE(share, 0);
      ASSERT_LE(share, 1);
      sum += share;
      squares += share * share;
    }
    const double n = setup.budget;
    EXPECT_NEAR(sum / n, 0.5, 5 * std::sqrt(1 / 12.0 / n));
    EXPECT_NEAR(squares / n, 1 / 3.0, 5 * std::sqrt(4 / 45.0 / n));  // variance of u^2
  }
}

TEST(RandomSearch, StepsDependOnSeed) {
  plugin_host::Catalog catalog;
  catalog.add(std::string(RELIGN_PLUGIN_DIR) + "/random");
  test::Pose first_step[2];
  for (const std::uint64_t seed : {0u, 1u}) {
    test::FakeSetup setup;
    setup.seed = seed;
    setup.merit = [](const test::Pose&, std::uint32_t) { return 0.0; };
    test::FakeTrial trial(setup);
    plugin_host::Algorithm algorithm(catalog.resolve_or_throw(plugin_host::Kind::optimizer, "random"), {});
    algorithm.run(trial.handle());
    first_step[seed] = trial.steps.at(0).pose;
  }
  EXPECT_NE(first_step[0], first_step[1]);
}

}  // namespace
}  // namespace relign
