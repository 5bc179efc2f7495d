#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <relign/instruction_set.hpp>

#include "contract/run_policy.h"

namespace relign {
namespace {

using testing::AllOf;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(Imitation, FollowsResidualGainSchedule) {
  test::GreyTrial grey(0.12);
  test::FakeTrial trial(grey.setup);
  test::run_policy("imitation", trial, {{"whole_guesses", 3}});
  ASSERT_EQ(trial.steps.size(), 6u);
  std::vector<double> first_axis, second_axis;
  test::Pose before(2, 0.0);
  for (const auto& visit : trial.steps) {
    first_axis.push_back(visit.pose[0] - before[0]);
    second_axis.push_back(visit.pose[1] - before[1]);
    before = visit.pose;
  }
  const auto near = [](double value) { return DoubleNear(value, 0.002); };  // inputs are rounded to bytes
  EXPECT_THAT(first_axis, ElementsAre(near(0.12), near(0.12), near(0.12), near(0.06), near(0.04), near(0.03)));
  // Frames before the first capture are dark.
  EXPECT_THAT(second_axis, ElementsAre(near(0), near(0.06), near(0.06), near(0.03), near(0.02), near(0.015)));
}

TEST(Imitation, ClampsMovesButNotRecommendations) {
  test::GreyTrial grey(0.8);
  test::FakeTrial trial(grey.setup);
  test::run_policy("imitation", trial);
  EXPECT_NEAR(trial.steps[0].pose[0], 0.2, 1e-12);
  ASSERT_EQ(trial.recommendations.size(), 7u);  // from step 0 on
  EXPECT_NEAR(trial.recommendations[0].pose[0], 0.8, 0.002);
  EXPECT_EQ(trial.recommendations[0].steps_made, 0u);
  EXPECT_NEAR(trial.recommendations[1].pose[0], 1.0, 0.002);
}

TEST(Imitation, RejectsOtherSceneWithTrainingCommand) {
  test::GreyTrial brighter(0.1, 0.001);
  test::FakeTrial trial(brighter.setup);
  EXPECT_THAT(test::refusal("imitation", trial),
              AllOf(HasSubstr("this scene has another reference image"), HasSubstr("relign-train imitate")));
  EXPECT_TRUE(trial.steps.empty());
  test::FakeTrial allowed(brighter.setup);
  EXPECT_EQ(test::refusal("imitation", allowed, {{"other_scenes", true}}), "");
  EXPECT_EQ(allowed.steps.size(), 6u);
}

TEST(Imitation, RejectsOtherAxesAndImageSizes) {
  test::GreyTrial grey(0.1);
  grey.setup.axes = 3;
  test::FakeTrial three(grey.setup);
  EXPECT_THAT(test::refusal("imitation", three, {{"other_scenes", true}}),
              HasSubstr("trained for 2 axes, this scene has 3"));
  test::GreyTrial odd(0.1);
  odd.image.width = odd.image.height = 30;
  test::FakeTrial thirty(odd.setup);
  EXPECT_THAT(test::refusal("imitation", thirty),
              AllOf(HasSubstr("30 x 30 pixels cannot be binned"), HasSubstr("relign-train imitate")));
}

TEST(Imitation, ShippedNetworkHasFiveAxes) {
  test::GreyTrial grey(0.1);
  test::FakeTrial trial(grey.setup);
  const std::string shipped = std::string(RELIGN_PLUGIN_DIR) + "/imitation/imitation.onnx";
  EXPECT_THAT(test::refusal("imitation", trial, {{"model", shipped}}),
              HasSubstr("trained for 5 axes, this scene has 2"));
}

// Complete trials, recorded with the processor's best instruction set and replayed with a smaller one.
TEST(Imitation, TrialsReplayBitForBitWithSmallerInstructionSet) {
  if (!processor_has(InstructionSet::avx2)) GTEST_SKIP() << "this processor has no AVX2";
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("relign-fewer-" + std::to_string(::getpid()));
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "suite.json")
      << R"({"scenes": ["relign_od"], "noise_levels": ["rho0"], "instances": 1, "steps": 4,
    "algorithms": ["imitation", "imitation-ppo", "ppo-paper"]})";
  const std::string program = std::string("'") + RELIGN_PROGRAM + "' --progress none ",
                    results = (folder / "results").string();
  const auto run = [&folder](const std::string& command) {
    return std::system((command + " > '" + (folder / "log").string() + "' 2>&1").c_str());
  };
  ASSERT_EQ(run(program + "run '" + (folder / "suite.json").string() + "' -o '" + results + "'"), 0);
  const std::string fewer =
      "RELIGN_ISA=avx2 OPENCV_CPU_DISABLE=AVX512_SKX,AVX2 GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX512F,-AVX2,-FMA ";
  EXPECT_EQ(run(fewer + program + "verify '" + results + "'"), 0) << std::ifstream(folder / "log").rdbuf();
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace relign
