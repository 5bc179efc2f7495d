#include <gtest/gtest.h>

#include "contract/fake_trial.h"
#include "plugin_host/objects.h"

namespace relign {
namespace {

TEST(Home, MovesOnceToNominalPose) {
  plugin_host::Catalog catalog;
  catalog.add(std::string(RELIGN_PLUGIN_DIR) + "/home");
  const plugin_host::Choice choice = catalog.resolve_or_throw(plugin_host::Kind::optimizer, "home");
  EXPECT_TRUE(choice.plugin->oracle);
  EXPECT_EQ(choice.plugin->observed_bits(), std::uint32_t{RELIGN_OBSERVES_START});

  test::FakeSetup setup;
  setup.observes = RELIGN_OBSERVES_START;
  setup.start = {0.1, 0.9, 0.3, 0.2, 0.7};
  setup.merit = [](const test::Pose&, std::uint32_t) { return 1.0; };
  test::FakeTrial trial(setup);
  plugin_host::Algorithm algorithm(choice, {});
  algorithm.run(trial.handle());
  ASSERT_EQ(trial.steps.size(), 1u);
  EXPECT_EQ(trial.steps[0].pose, test::Pose(5, 0.5));
  ASSERT_EQ(trial.recommendations.size(), 1u);
  EXPECT_EQ(trial.recommendations[0].pose, test::Pose(5, 0.5));
  EXPECT_FALSE(trial.stopped);
}

}  // namespace
}  // namespace relign
