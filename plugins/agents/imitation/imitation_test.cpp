#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <relign/instruction_set.hpp>

#include "base/files.h"
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

// One reading, the distance from 0.3 along the first axis plus 0.1, for the network of tests/golden/policies.
struct ReadingTrial : test::GreyTrial {
  ReadingTrial() : GreyTrial(0) {
    setup.image_side = 1;
    setup.readings_json = R"([{"name": "loss"}])";
    setup.largest_move = std::numeric_limits<double>::infinity();
    setup.merit = [](const test::Pose& pose, std::uint32_t) { return std::fabs(pose[0] - 0.3) + 0.1; };
    setup.paint = {};
    wanted.assign(1, 0.5F);
    image = {sizeof image, RELIGN_SAMPLE_FLOAT32, 1, 1, 1, 0, wanted.data(), sizeof(float)};
  }
};

std::string network_of_readings(const Json& changes) {
  const std::filesystem::path golden = std::filesystem::path(RELIGN_SOURCE_DIR) / "tests/golden/policies";
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() /
      (std::string("relign-readings-") + testing::UnitTest::GetInstance()->current_test_info()->name());
  std::filesystem::create_directories(folder);
  std::filesystem::copy_file(golden / "readings.onnx", folder / "net.onnx",
                             std::filesystem::copy_options::overwrite_existing);
  Json side = Json::parse(read_file(golden / "readings.json"));
  side.update(changes);
  std::ofstream(folder / "net.json") << side.dump();
  return (folder / "net.onnx").string();
}

TEST(Imitation, FollowsNetworkOfReadingsAndRecommendsLowestOne) {
  ReadingTrial reading;
  test::FakeTrial trial(reading.setup);
  test::run_policy("imitation", trial, {{"model", network_of_readings(Json::object())}});
  ASSERT_EQ(trial.steps.size(), 6u);
  const auto near = [](double value) { return DoubleNear(value, 1e-6); };
  // The start reads 0.4: a tenth of it; then 0.36 and so on. All moves are in full.
  EXPECT_THAT(trial.steps[0].pose, ElementsAre(near(0.04), near(0.04)));
  EXPECT_THAT(trial.steps[1].pose, ElementsAre(near(0.076), near(0.076)));
  EXPECT_EQ(trial.recommendations.back().pose, trial.steps.back().pose);
}

TEST(Imitation, VisitsProbesUntilOneIsLowEnough) {
  ReadingTrial reading;
  test::FakeTrial trial(reading.setup);
  test::run_policy("imitation", trial,
                   {{"model", network_of_readings(
                                  {{"probes", {{"poses", {{-0.3, 0.1}, {0.3, 0.0}, {-0.5, 0.0}}}, {"until", 0.2}}}})}});
  ASSERT_EQ(trial.steps.size(), 6u);
  EXPECT_EQ(trial.steps[0].pose, (test::Pose{-0.3, 0.1}));  // moves of a probe may be longer than those of the network
  EXPECT_EQ(trial.steps[1].pose, (test::Pose{0.3, 0.0}));   // reads 0.1: the third probe is not visited
  EXPECT_NEAR(trial.steps[2].pose[0], 0.31, 1e-6);
  EXPECT_EQ(trial.recommendations.back().pose, trial.steps[1].pose);
}

TEST(Imitation, RejectsOtherReadings) {
  ReadingTrial reading;
  test::FakeTrial trial(reading.setup);
  const auto refused = [&trial](const Json& changes) {
    return test::refusal("imitation", trial, {{"model", network_of_readings(changes)}});
  };
  EXPECT_EQ(refused(Json::object()), "");
  EXPECT_THAT(refused({{"reference", {{"readings", {0.51}}}}}), HasSubstr("whose reference reading 'loss' is 0.51"));
  test::GreyTrial grey(0.1);
  test::FakeTrial images(grey.setup);
  EXPECT_THAT(test::refusal("imitation", images, {{"model", network_of_readings(Json::object())}}),
              HasSubstr("trained for the readings 'loss', this scene has none"));
  reading.setup.readings_json = R"([{"name": "loss", "unit": "mW"}])";
  test::FakeTrial other(reading.setup);
  EXPECT_THAT(test::refusal("imitation", other, {{"model", network_of_readings(Json::object())}}),
              HasSubstr("this scene has 'loss' in mW"));
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
