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

TEST(PpoPaper, FollowsEveryMoveInFull) {
  test::GreyTrial grey(0.12);
  grey.setup.budget = 12;
  test::FakeTrial trial(grey.setup);
  test::run_policy("ppo_paper", trial, {{"model", network_of_moves()}});
  std::vector<double> moves;
  double before = 0;
  for (const auto& visit : trial.steps) {
    moves.push_back(visit.pose[0] - before);
    before = visit.pose[0];
  }
  ASSERT_EQ(moves.size(), 12u);
  EXPECT_THAT(moves, Each(DoubleNear(0.12, 0.002)));
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
