#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "base/files.h"
#include "contract/run_policy.h"

namespace relign {
namespace {

using testing::AllOf;
using testing::DoubleNear;
using testing::Each;
using testing::HasSubstr;

// The golden network, said to give moves as the paper's does.
std::string network_of_moves() {
  const std::filesystem::path golden = std::filesystem::path(RELIGN_SOURCE_DIR) / "tests/golden/policies";
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "relign-ppo-test";
  std::filesystem::create_directories(folder);
  std::filesystem::copy_file(golden / "tiny.onnx", folder / "moves.onnx",
                             std::filesystem::copy_options::overwrite_existing);
  Json side = Json::parse(read_file(golden / "tiny.json"));
  side["output"] = "move";
  std::ofstream(folder / "moves.json") << side.dump();
  return (folder / "moves.onnx").string();
}

TEST(Ppo, MovesAreFollowedWholeAtEveryStep) {
  test::GreyTrial trial(0.12);
  trial.setup.budget = 12;
  test::FakeConversation conversation(trial.setup);
  test::run_policy("ppo", conversation, {{"model", network_of_moves()}});
  std::vector<double> moves;
  double before = 0;
  for (const auto& visit : conversation.steps) {
    moves.push_back(visit.pose[0] - before);
    before = visit.pose[0];
  }
  ASSERT_EQ(moves.size(), 12u);
  EXPECT_THAT(moves, Each(DoubleNear(0.12, 0.002)));
}

TEST(Ppo, RecommendsWhereTheNextMoveLeads) {
  test::GreyTrial trial(0.8);
  test::FakeConversation conversation(trial.setup);
  test::run_policy("ppo", conversation, {{"model", network_of_moves()}});
  ASSERT_GE(conversation.recommendations.size(), 2u);
  EXPECT_NEAR(conversation.recommendations[0].pose[0], 0.2, 1e-12);
  EXPECT_NEAR(conversation.recommendations[1].pose[0], 0.4, 1e-12);
}

class ShippedNetwork : public testing::TestWithParam<const char*> {};

TEST_P(ShippedNetwork, IsForTheScenesFiveAxes) {
  test::GreyTrial trial(0.1);
  test::FakeConversation conversation(trial.setup);
  const std::string shipped = std::string(RELIGN_PLUGIN_DIR) + "/ppo/" + GetParam();
  EXPECT_THAT(test::refusal("ppo", conversation, {{"model", shipped}}),
              AllOf(HasSubstr("trained to move 5 axes, this scene has 2"), HasSubstr("--scene SCENE")))
      << "the command is for another scene than the network's";
}

INSTANTIATE_TEST_SUITE_P(Ppo, ShippedNetwork, testing::Values("ppo.onnx", "ppo-paper.onnx"));

}  // namespace
}  // namespace relign
