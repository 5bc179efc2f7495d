#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "base/files.h"
#include "contract/run_policy.h"

namespace relign {
namespace {

using testing::AllOf;
using testing::DoubleNear;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

// The golden network with relative output ("move"), as the paper's has.
std::string network_of_moves() {
  const std::filesystem::path golden = std::filesystem::path(RELIGN_SOURCE_DIR) / "tests/golden/policies";
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "relign-ppo-paper-test";
  std::filesystem::create_directories(folder);
  std::filesystem::copy_file(golden / "tiny.onnx", folder / "moves.onnx",
                             std::filesystem::copy_options::overwrite_existing);
  Json side = Json::parse(read_file(golden / "tiny.json"));
  side["output"] = "move";
  std::ofstream(folder / "moves.json") << side.dump();
  return (folder / "moves.onnx").string();
}

// Along the first axis, of a network whose output is about 0.12 everywhere.
std::vector<double> moves_of(unsigned count, Json parameters) {
  test::GreyTrial grey(0.12);
  grey.setup.budget = count;
  test::FakeTrial trial(grey.setup);
  parameters["model"] = network_of_moves();
  test::run_policy("ppo_paper", trial, parameters);
  std::vector<double> moves;
  double before = 0;
  for (const auto& visit : trial.steps) {
    moves.push_back(visit.pose[0] - before);
    before = visit.pose[0];
  }
  return moves;
}

TEST(PpoPaper, FollowsEveryMoveInFull) {
  const std::vector<double> moves = moves_of(12, Json::object());
  ASSERT_EQ(moves.size(), 12u);
  EXPECT_THAT(moves, Each(DoubleNear(0.12, 0.002)));
}

TEST(PpoPaper, MovesShrinkAfterTheFullOnes) {
  EXPECT_THAT(moves_of(6, {{"full_moves", 3}}),
              ElementsAre(DoubleNear(0.12, 0.002), DoubleNear(0.12, 0.002), DoubleNear(0.12, 0.002),
                          DoubleNear(0.09, 0.002), DoubleNear(0.072, 0.002), DoubleNear(0.06, 0.002)));
}

TEST(PpoPaper, RefusesToShrinkMovesOfADisplacement) {
  test::GreyTrial grey(0.1);
  test::FakeTrial trial(grey.setup);
  const std::string displacement = std::string(RELIGN_SOURCE_DIR) + "/tests/golden/policies/tiny.onnx";
  EXPECT_THAT(test::refusal("ppo_paper", trial, {{"model", displacement}, {"full_moves", 3}}),
              HasSubstr("predicts the displacement to the optimum, see 'whole_guesses'"));
}

TEST(PpoPaper, RecommendsPoseOfCaptureNearestToReference) {
  test::GreyTrial grey(0, 0.03F);
  grey.setup.merit = [](const std::vector<double>& pose, std::uint32_t) { return std::fabs(pose[0] - 0.3); };
  grey.setup.paint = [](double away, float* pixels) {  // moves of at least 0.1; equal to the reference at 0.3
    std::fill(pixels, pixels + 1600, static_cast<float>(0.3 * (0.1 + 0.5 * away)));
  };
  test::FakeTrial trial(grey.setup);
  test::run_policy("ppo_paper", trial, {{"model", network_of_moves()}, {"other_scenes", true}});
  std::vector<double> at = {0};
  for (const auto& visit : trial.steps) at.push_back(visit.pose[0]);
  ASSERT_GT(at.back(), 0.6) << "must move past the optimum";
  const double nearest = *std::min_element(
      at.begin(), at.end(), [](double one, double other) { return std::fabs(one - 0.3) < std::fabs(other - 0.3); });
  EXPECT_EQ(trial.recommendations.front().steps_made, 0u);
  EXPECT_EQ(trial.recommendations.back().pose[0], nearest);
}

class ShippedNetwork : public testing::TestWithParam<const char*> {};

TEST_P(ShippedNetwork, HasFiveAxes) {
  test::GreyTrial grey(0.1);
  test::FakeTrial trial(grey.setup);
  const std::string agent = GetParam();
  std::string folder = agent;
  std::replace(folder.begin(), folder.end(), '-', '_');
  const std::string shipped = std::string(RELIGN_PLUGIN_DIR) + "/" + folder + "/" + agent + ".onnx";
  EXPECT_THAT(test::refusal(folder, trial, {{"model", shipped}}),
              AllOf(HasSubstr("trained for 5 axes, this scene has 2"), HasSubstr("--scene SCENE")))
      << "the command must not name the network's scene";
}

INSTANTIATE_TEST_SUITE_P(Ppo, ShippedNetwork, testing::Values("imitation-ppo", "ppo-paper"));

}  // namespace
}  // namespace relign
