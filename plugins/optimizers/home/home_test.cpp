#include <gtest/gtest.h>

#include "contract/fake_conversation.h"
#include "plugin_host/objects.h"

namespace relign {
namespace {

TEST(Home, MovesOnceToNominalPose) {
  plugin_host::Catalog catalog;
  catalog.add(std::string(RELIGN_PLUGIN_DIR) + "/home");
  const plugin_host::Choice choice = catalog.resolve_or_throw(plugin_host::Kind::optimizer, "home");
  EXPECT_TRUE(choice.plugin->oracle);
  EXPECT_EQ(choice.plugin->knows_bits(), std::uint32_t{RELIGN_KNOWS_START});

  test::FakeSetup setup;
  setup.knows = RELIGN_KNOWS_START;
  setup.start = {0.1, 0.9, 0.3, 0.2, 0.7};
  setup.merit = [](const test::Pose&, std::uint32_t) { return 1.0; };
  test::FakeConversation conversation(setup);
  plugin_host::Algorithm algorithm(choice, {});
  algorithm.run(conversation.talk());
  ASSERT_EQ(conversation.steps.size(), 1u);
  EXPECT_EQ(conversation.steps[0].pose, test::Pose(5, 0.5));
  ASSERT_EQ(conversation.recommendations.size(), 1u);
  EXPECT_EQ(conversation.recommendations[0].pose, test::Pose(5, 0.5));
  EXPECT_FALSE(conversation.stopped);
}

}  // namespace
}  // namespace relign
