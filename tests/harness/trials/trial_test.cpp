// Trials on the fake scene, whose scores are computed by hand: records, clocks, ground truth, seeds, and the
// algorithm's observations. Start (0.3, 0.58, 0.5), optimum and nominal pose 0.5, no distortion.
#include "trials/trial.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <relign/random.hpp>

#include "trials/fakes.h"

namespace relign::trials {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

const char* const kTwoSteps = R"([["first"], ["step", 0.5, 0.58, 0.5], ["step", 0.5, 0.58, 0.55]])";
const double kDistance[] = {std::sqrt(0.04 + 0.0064), 0.08, std::sqrt(0.0064 + 0.0025)};  // to the optimum
constexpr double kFloat = 1e-7;                                                           // captures are float32

TEST(Trial, RecordsPosesScoresAndEnd) {
  TrialFixture trial(kTwoSteps);
  const TrialResult result = trial.run();
  EXPECT_EQ(result.end, End::finished);
  EXPECT_EQ(result.message, "");
  EXPECT_THAT(result.environment_changes, IsEmpty());
  ASSERT_THAT(result.steps, SizeIs(3));
  EXPECT_THAT(result.steps[0].commanded_pose, ElementsAre(0.3, 0.58, 0.5));
  EXPECT_THAT(result.steps[0].true_pose, ElementsAre(0.3, 0.58, 0.5));
  EXPECT_THAT(result.steps[2].commanded_pose, ElementsAre(0.5, 0.58, 0.55));
  for (unsigned k = 0; k < 3; ++k) {
    EXPECT_EQ(result.steps[k].step, k);
    EXPECT_NEAR(result.steps[k].measured, kDistance[k], kFloat);
  }
  // Combined merit: the distance to the nominal pose counts while it is above 0.1.
  EXPECT_NEAR(result.steps[0].merit, 2 * kDistance[0], kFloat);
  EXPECT_NEAR(result.steps[1].merit, kDistance[1], kFloat);
  EXPECT_NEAR(result.steps[2].merit, kDistance[2], kFloat);
}

TEST(Trial, MeritCanBeOverridden) {
  TrialFixture trial(kTwoSteps);
  trial.terms.merit = Merit::rmse;
  const TrialResult result = trial.run();
  EXPECT_EQ(result.steps[0].merit, result.steps[0].measured);
  EXPECT_EQ(trial.logged("seen")[0]["merit"], result.steps[0].measured);
}

TEST(Trial, MatchesMachineTimeByHand) {
  // 5 mm/s over 2 mm: 0.4 s a travel; 5 deg/s over 14 deg: 2.8 s. Settle 40, exposure 15, readout 30 ms.
  TrialFixture trial(kTwoSteps);
  const TrialResult result = trial.run();
  EXPECT_NEAR(result.steps[0].machine_seconds, 0.045, 1e-12);
  EXPECT_NEAR(result.steps[1].machine_seconds, 0.045 + 0.08 + 0.085, 1e-12);
  EXPECT_NEAR(result.steps[2].machine_seconds, 0.21 + 0.14 + 0.085, 1e-12);
  // The best measured pose is that of step 1: from step 2 the stage must travel back and settle.
  EXPECT_NEAR(result.steps[0].recommended_seconds, 0.045, 1e-12);
  EXPECT_NEAR(result.steps[1].recommended_seconds, 0.21, 1e-12);
  EXPECT_NEAR(result.steps[2].recommended_seconds, 0.435 + 0.14 + 0.04, 1e-12);
  EXPECT_NEAR(trial.logged("seen")[2]["seconds"].get<double>(), 0.435, 1e-12);
}

TEST(Trial, UsesMachineTimeOfTheSetup) {
  TrialFixture trial(kTwoSteps);
  trial.terms.machine_time = MachineTime{1, 14, 0, 100, 0};
  const TrialResult result = trial.run();
  EXPECT_NEAR(result.steps[1].machine_seconds, 0.1 + 0.4 + 0.1, 1e-12);
  EXPECT_NEAR(result.steps[2].machine_seconds, 0.6 + 0.05 + 0.1, 1e-12);
}

double truth_noise(std::uint64_t seed) { return 1e-6 * Random(seed).uniform(); }

TEST(Trial, MatchesGroundTruthByHand) {
  TrialFixture trial(R"([["step", 0.5, 0.58, 0.5], ["recommend", 0.5, 0.5, 0.6], ["step", 0.5, 0.5, 0.6], ["first"]])");
  const TrialResult result = trial.run();
  ASSERT_THAT(result.steps, SizeIs(3));
  const auto noise = [](unsigned step, FrameStream stream) { return truth_noise(frame_seed(77, step, stream)); };
  const double d0 = 0.0464, d1 = 0.0064, d2 = 0.01;  // squared distances; 0.01 is the recommended pose's
  EXPECT_NEAR(result.steps[0].commanded_mse, d0 + noise(0, FrameStream::truth_commanded), 1e-14);
  EXPECT_EQ(result.steps[0].commanded_mse_error, 1e-7);
  EXPECT_EQ(result.steps[0].recommended_mse, result.steps[0].commanded_mse);
  EXPECT_NEAR(result.steps[1].commanded_mse, d1 + noise(1, FrameStream::truth_commanded), 1e-14);
  EXPECT_NEAR(result.steps[1].recommended_mse, d2 + noise(1, FrameStream::truth_recommended), 1e-14);
  // Step 2 reaches the recommended pose: one pose, one score.
  EXPECT_EQ(result.steps[2].true_pose, result.steps[1].recommended_true_pose);
  EXPECT_EQ(result.steps[2].commanded_mse, result.steps[1].recommended_mse);
  EXPECT_EQ(result.steps[2].recommended_mse, result.steps[1].recommended_mse);
  EXPECT_THAT(trial.seeds("truth"), ElementsAre(frame_seed(77, 0, FrameStream::truth_commanded),
                                                frame_seed(77, 1, FrameStream::truth_commanded),
                                                frame_seed(77, 1, FrameStream::truth_recommended)))
      << "three poses, three evaluations";
}

TEST(Trial, AppliesStageMotionToTheRecommendation) {
  TrialFixture trial(R"([["recommend", 0.5, 0.5, 1.5]])");
  trial.instance.perturbations.distortion = {1, 0, 0, 0, 2, 0, 0, 0, 1};
  const TrialResult result = trial.run();
  // y: 0.58 + 2 (0.5 - 0.58) = 0.42; Rx meets its limit.
  EXPECT_THAT(result.steps[0].recommended_true_pose,
              testing::Pointwise(testing::DoubleNear(1e-15), std::vector<double>{0.5, 0.42, 1.0}));
  EXPECT_THAT(result.steps[0].true_pose, ElementsAre(0.3, 0.58, 0.5)) << "nothing moved";
  EXPECT_NEAR(result.steps[0].recommended_seconds, 0.045 + 0.5 * 2.8 + 0.04, 1e-12) << "travel up to the limit";
}

TEST(Trial, AllAlgorithmsOfAnInstanceGetTheSameNoise) {
  TrialFixture one(kTwoSteps);
  TrialFixture other(R"([["move", 0.1, 0, 0], ["move", 0.1, 0, 0]])", "fake_agent");
  other.terms.algorithm_seed = 99;
  one.run();
  other.run();
  EXPECT_THAT(one.seeds("capture"),
              ElementsAre(frame_seed(77, 0, FrameStream::capture), frame_seed(77, 1, FrameStream::capture),
                          frame_seed(77, 2, FrameStream::capture)));
  EXPECT_EQ(one.seeds("capture"), other.seeds("capture"));
}

TEST(Trial, IsDeterministic) {
  const auto run = [] {
    TrialFixture trial(R"([["move", 0.1, 0.2, 0.3],
          ["step", 0.4, 0.41, 0.42],
          ["move", 5, 0, 0],
          ["move", -0.1, 0, 0]])",
                       "fake_optimizer", {{"noise", 0.3}});
    trial.instance.perturbations.distortion = {1.01, 0.02, -0.01, 0.03, 0.98, 0.01, 0, -0.02, 1.02};
    return trial.run();
  };
  const TrialResult one = run(), two = run();
  ASSERT_THAT(one.steps, SizeIs(5));
  ASSERT_THAT(two.steps, SizeIs(5));
  for (std::size_t k = 0; k < one.steps.size(); ++k) {
    const Step &a = one.steps[k], &b = two.steps[k];
    EXPECT_EQ(a.true_pose, b.true_pose);
    EXPECT_EQ(a.measured, b.measured);
    EXPECT_EQ(a.merit, b.merit);
    EXPECT_EQ(a.machine_seconds, b.machine_seconds);
    EXPECT_EQ(a.recommended_true_pose, b.recommended_true_pose);
    EXPECT_EQ(a.commanded_mse, b.commanded_mse);
    EXPECT_EQ(a.recommended_mse, b.recommended_mse);
  }
}

TEST(Trial, ShowsAnOptimizerTheObservationsOfThePaper) {
  TrialFixture trial(kTwoSteps);
  trial.run();
  const Json task = trial.logged("task").at(0);
  EXPECT_EQ(task["axes"], 3);
  EXPECT_EQ(task["budget"], 4);
  EXPECT_EQ(task["seed"], 5);
  EXPECT_EQ(task["observes"],
            RELIGN_OBSERVES_IMAGES | RELIGN_OBSERVES_MERIT | RELIGN_OBSERVES_START | RELIGN_OBSERVES_BOX);
  EXPECT_EQ(task["largest_move"], "unlimited");
  EXPECT_EQ(task["box"], (Json{{0.2, 0.2, 0.2}, {0.8, 0.8, 0.8}}));
  EXPECT_EQ(task["service"], false);
  const auto seen = trial.logged("seen");
  ASSERT_THAT(seen, SizeIs(3));
  EXPECT_EQ(seen[1]["step"], 1);
  EXPECT_EQ(seen[1]["pose"], (Json{0.5, 0.58, 0.5}));
  EXPECT_NEAR(seen[1]["merit"].get<double>(), 0.08, kFloat);
  EXPECT_NEAR(seen[1]["pixel"].get<double>(), 0.58, kFloat) << "the image of this step";
}

TEST(Trial, BlindCoordinatesAreRelativeToTheStart) {
  TrialFixture trial(R"([["first"], ["step", 0.2, 0, 0], ["move", 0.6, -0.6, 0]])");
  trial.terms.protocol = Protocol::blind;
  const TrialResult result = trial.run();
  const Json task = trial.logged("task").at(0);
  EXPECT_EQ(task["observes"], RELIGN_OBSERVES_IMAGES | RELIGN_OBSERVES_MERIT | RELIGN_OBSERVES_BOX);
  EXPECT_EQ(task["box"], (Json{{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}}));
  const auto seen = trial.logged("seen");
  EXPECT_EQ(seen[0]["pose"], (Json{0.0, 0.0, 0.0}));
  EXPECT_NEAR(seen[0]["merit"].get<double>(), kDistance[0], kFloat) << "the merit does not reveal the distance";
  EXPECT_EQ(seen[1]["low"], 0);
  EXPECT_EQ(seen[2]["high"], 1);
  EXPECT_EQ(seen[2]["low"], 2);
  EXPECT_EQ(result.steps[2].limits_high, 1u);
  EXPECT_EQ(result.steps[2].limits_low, 2u);
  EXPECT_THAT(result.steps[1].true_pose, ElementsAre(0.5, 0.58, 0.5));
  EXPECT_THAT(result.steps[2].true_pose, ElementsAre(1.0, 0.0, 0.5));
}

TEST(Trial, AgentGetsOnlyImagesAndShortMoves) {
  TrialFixture trial(R"([["first"], ["move", 0.5, -0.1, -7], ["step", -0.1, 0, 0]])", "fake_agent");
  const TrialResult result = trial.run();
  EXPECT_EQ(trial.logged("task").at(0)["largest_move"], 0.2);
  EXPECT_EQ(trial.logged("task").at(0)["box"], nullptr);
  const auto seen = trial.logged("seen");
  ASSERT_THAT(seen, SizeIs(3));
  EXPECT_EQ(seen[0]["merit"], nullptr);
  EXPECT_NEAR(seen[0]["pixel"].get<double>(), 0.5 + kDistance[0], kFloat);
  EXPECT_EQ(seen[1]["pose"], (Json{0.2, -0.1, -0.2})) << "each axis is cut separately";
  EXPECT_EQ(seen[2]["pose"], (Json{0.0, 0.0, 0.0})) << "absolute moves are cut, too; the uncut axes reach their target";
  EXPECT_NEAR(result.steps[1].merit, result.steps[1].measured + std::sqrt(0.0004 + 0.04), kFloat)
      << "recorded although not shown";
}

TEST(Trial, PassesPixelsWithoutCopying) {
  TrialFixture trial(R"([["show_buffers"], ["first"], ["step", 0.5, 0.58, 0.5], ["step", 0.5, 0.58, 0.55]])",
                     "fake_agent");
  std::vector<std::uint64_t> recorded;
  trial.callbacks.on_step = [&](const Step&, const float* pixels) {
    recorded.push_back(reinterpret_cast<std::uintptr_t>(pixels));
  };
  trial.run();
  const std::vector<std::uint64_t> written = trial.buffers();
  std::vector<std::uint64_t> seen;
  for (const Json& buffer : trial.logged("buffer")) seen.push_back(buffer);
  ASSERT_THAT(seen, SizeIs(3));
  EXPECT_EQ(seen, written) << "pixels were copied";
  EXPECT_EQ(recorded, written);
}

TEST(Trial, OracleGetsTheStartUnderEveryProtocol) {
  TrialFixture trial(R"([["first"]])", "fake_oracle");
  trial.terms.protocol = Protocol::blind;
  trial.run();
  EXPECT_EQ(trial.logged("seen").at(0)["pose"], (Json{0.3, 0.58, 0.5}));
  EXPECT_EQ(trial.logged("seen").at(0)["pixel"], nullptr) << "it declared no images";
}

TEST(Trial, AppliesHardLimits) {
  TrialFixture trial(R"([["step", 1.7, 0.58, 0.9]])");
  trial.terms.limits = Limits::hard;
  const TrialResult result = trial.run();
  EXPECT_THAT(result.steps[1].true_pose,
              testing::Pointwise(testing::DoubleNear(1e-15), std::vector<double>{1.0, 0.58, 0.7}));
}

TEST(Trial, RelativeMovesContinueFromTheLimit) {
  TrialFixture trial(R"([["move", 5, 0, 0], ["move", -0.25, 0, 0]])");
  const TrialResult result = trial.run();
  EXPECT_EQ(result.steps[1].true_pose[0], 1.0);
  EXPECT_NEAR(result.steps[2].true_pose[0], 0.75, 1e-12);
  EXPECT_NEAR(result.steps[2].commanded_pose[0], 0.75, 1e-12);
}

TEST(Trial, LargestMoveIsMeasuredFromTheLimit) {
  TrialFixture trial(R"([["move", 0.2, 0, 0], ["move", 0.2, 0, 0], ["step", 0, 0, 0]])", "fake_agent");
  trial.instance.perturbations.start = {0.75, 0.5, 0.5};  // the second move is stopped at 0.25 of 0.4
  const TrialResult result = trial.run();
  ASSERT_EQ(result.steps[2].true_pose[0], 1.0);
  EXPECT_NEAR(result.steps[3].commanded_pose[0], 0.05, 1e-12);
}

TEST(Trial, TimesAlgorithmAndSimulationSeparately) {
  TrialFixture trial(R"([["nap", 30], ["step", 0.5, 0.5, 0.5], ["step", 0.5, 0.5, 0.6], ["nap", 20]])");
  const TrialResult result = trial.run();
  EXPECT_EQ(result.steps[0].algorithm_seconds, 0);
  EXPECT_GE(result.steps[1].algorithm_seconds, 0.030);
  EXPECT_LT(result.steps[2].algorithm_seconds, 0.030);
  EXPECT_GE(result.seconds_after_last_step, 0.020);
  for (const Step& step : result.steps) {
    EXPECT_GT(step.simulation_seconds, 0);
    EXPECT_GT(step.truth_seconds, 0);
  }
}

TEST(Trial, KeepsStepZeroWhenStoppedAtOnce) {
  TrialFixture trial(R"([["step", 0.5, 0.5, 0.5]])");
  trial.terms.budget = 0;
  const TrialResult result = trial.run();
  EXPECT_THAT(result.steps, SizeIs(1));
  EXPECT_EQ(result.end, End::budget_spent);
}

TEST(Trial, NamesEnds) { EXPECT_STREQ(end_name(End::budget_spent), "budget_spent"); }

}  // namespace
}  // namespace relign::trials
