// Which pose counts as recommended at each step, and when a step's record is complete.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "trials/fakes.h"

namespace relign::trials {
namespace {

using records::Rule;

using testing::DoubleEq;
using testing::ElementsAre;
using testing::SizeIs;

TEST(Recommendation, StaysUntilReplacedAndBelongsToTheStepBefore) {
  TrialFixture trial(
      R"([["step", 0.4, 0.5, 0.5],
          ["step", 0.45, 0.5, 0.5],
          ["recommend", 0.44, 0.5, 0.5],
          ["recommend", 0.43, 0.5, 0.5],
          ["step", 0.6, 0.5, 0.5],
          ["step", 0.7, 0.5, 0.5],
          ["recommend", 0.5, 0.5, 0.5]])");
  const TrialResult result = trial.run();
  ASSERT_THAT(result.steps, SizeIs(5));
  const auto source = [&](std::size_t k) { return result.steps[k].recommendation; };
  const auto x = [&](std::size_t k) { return result.steps[k].recommended_pose[0]; };
  EXPECT_EQ(source(0), "best_measured");
  EXPECT_EQ(source(1), "best_measured");
  EXPECT_EQ(x(1), 0.4);
  EXPECT_EQ(source(2), "own");
  EXPECT_EQ(x(2), 0.43) << "the last recommendation before the next step";
  EXPECT_EQ(source(3), "own");
  EXPECT_EQ(x(3), 0.43);
  EXPECT_EQ(source(4), "own");
  EXPECT_EQ(x(4), 0.5) << "given after the last step, before the end";
  EXPECT_EQ(result.end, End::budget_spent) << "all steps used, none requested beyond them";
}

TEST(Recommendation, IsScoredAfterCuring) {
  const char* const script = R"([["step", 0.4, 0.5, 0.5], ["recommend", 0.45, 0.5, 0.5], ["step", 0.98, 0.5, 0.5],
                                 ["recommend", 0.98, 0.5, 0.5]])";
  TrialFixture without(script), with(script);
  with.instance.perturbations.cure_shift = {0.05, -0.01, 0};
  const TrialResult before = without.run(), after = with.run();
  ASSERT_THAT(after.steps, SizeIs(3));
  for (std::size_t k = 0; k < after.steps.size(); ++k) {
    // Curing affects neither poses nor captures nor the ground truth of the commanded pose.
    EXPECT_EQ(after.steps[k].true_pose, before.steps[k].true_pose);
    EXPECT_EQ(after.steps[k].measured, before.steps[k].measured);
    EXPECT_EQ(after.steps[k].commanded_mse, before.steps[k].commanded_mse);
    EXPECT_EQ(after.steps[k].recommended_seconds, before.steps[k].recommended_seconds);
    EXPECT_EQ(after.steps[k].recommended_pose, before.steps[k].recommended_pose);
    EXPECT_NE(after.steps[k].recommended_mse, before.steps[k].recommended_mse);
  }
  EXPECT_THAT(before.steps[1].recommended_true_pose, ElementsAre(DoubleEq(0.45), DoubleEq(0.5), 0.5));
  EXPECT_THAT(after.steps[1].recommended_true_pose, ElementsAre(DoubleEq(0.5), DoubleEq(0.49), 0.5));
  EXPECT_EQ(after.steps[2].recommended_true_pose[0], 1) << "scenes accept only poses within the travel";
  // The score of the last recommendation before curing is reported once.
  EXPECT_EQ(after.scores.uncured_mse[Rule::own], before.steps[2].recommended_mse);
  EXPECT_TRUE(std::isnan(before.scores.uncured_mse[Rule::own])) << "curing shifts nothing";
}

// Recommendation rules other than the method's own are scored at commanded poses, each pose once.
TEST(Recommendation, ScoresEveryStepAfterCuring) {
  const char* const script = R"([["step", 0.4, 0.5, 0.5], ["recommend", 0.4, 0.5, 0.5], ["step", 0.98, 0.5, 0.5]])";
  TrialFixture without(script), with(script);
  with.instance.perturbations.cure_shift = {0.05, -0.01, 0};
  EXPECT_THAT(without.run().scores.by_step[Rule::current].mse, SizeIs(0)) << "equals commanded_mse";
  const TrialResult result = with.run();
  ASSERT_THAT(result.scores.by_step[Rule::current].mse, SizeIs(3));
  EXPECT_EQ(result.scores.by_step[Rule::current].mse[1], result.steps[2].recommended_mse) << "the recommended pose";
  EXPECT_NE(result.scores.by_step[Rule::current].mse[2], result.steps[2].commanded_mse);
  TrialFixture there(R"([["step", 0.4, 0.5, 0.5], ["recommend", 0.4, 0.5, 0.5], ["step", 0.98, 0.5, 0.5],
                      ["recommend", 0.98, 0.5, 0.5]])");
  there.instance.perturbations.cure_shift = with.instance.perturbations.cure_shift;
  EXPECT_EQ(there.run().steps[2].recommended_mse, result.scores.by_step[Rule::current].mse[2]);
}

const StageErrors kStageErrors = {{0.02, 0.01, 0}, {0.002, 0.001, 0.003}, {0.001, 0, 0}, {0.01, -0.01, 0}, 2};

// The stage has errors, so that the end of a move depends on the moves before.
TEST(Recommendation, IsJudgedByTheMoveThatWouldFollow) {
  const auto run = [](const char* script) {
    TrialFixture trial(script);
    trial.instance.perturbations.stage = kStageErrors;
    return trial.run().steps;
  };
  const std::vector<Step> steps = run(R"([["step", 0.4, 0.5, 0.5], ["recommend", 0.46, 0.5, 0.52],
                                          ["step", 0.6, 0.5, 0.5], ["step", 0.6, 0.5, 0.5],
                                          ["recommend", 0.6, 0.5, 0.5]])");
  const std::vector<Step> after_one = run(R"([["step", 0.4, 0.5, 0.5], ["step", 0.46, 0.5, 0.52]])");
  const std::vector<Step> after_two =
      run(R"([["step", 0.4, 0.5, 0.5], ["step", 0.6, 0.5, 0.5], ["step", 0.46, 0.5, 0.52]])");
  ASSERT_THAT(steps, SizeIs(4));
  EXPECT_EQ(steps[1].true_pose, after_one[1].true_pose);
  EXPECT_EQ(steps[1].recommended_true_pose, after_one[2].true_pose);
  EXPECT_EQ(steps[2].recommended_true_pose, after_two[3].true_pose);
  EXPECT_NE(steps[2].recommended_true_pose, steps[1].recommended_true_pose) << "from the other side";
  EXPECT_NE(steps[3].true_pose, steps[2].true_pose) << "the stage drifts";
  EXPECT_EQ(steps[3].recommended_true_pose, steps[3].true_pose) << "no move is needed";
}

TEST(Recommendation, OfTheBestStepIsAMoveOfItsOwn) {
  const auto run = [](const char* more, std::vector<double> cure_shift = {}) {
    TrialFixture trial(std::string(R"([["step", 0.45, 0.5, 0.5], ["step", 0.7, 0.5, 0.5])") + more + "]");
    trial.terms.merit = Merit::rmse;
    trial.instance.perturbations.stage = kStageErrors;
    trial.instance.perturbations.cure_shift = std::move(cure_shift);
    return trial.run();
  };
  const TrialResult result = run(R"(, ["recommend", 0.7, 0.5, 0.5])"), back = run(R"(, ["step", 0.45, 0.5, 0.5])");
  ASSERT_THAT(result.scores.by_step[Rule::best].mse, SizeIs(3));
  EXPECT_EQ(result.scores.by_step[Rule::best].mse[0], result.steps[0].commanded_mse) << "no move is needed";
  EXPECT_EQ(result.scores.by_step[Rule::best].mse[1], result.steps[1].commanded_mse);
  EXPECT_NE(result.scores.by_step[Rule::best].mse[2], result.steps[1].commanded_mse);
  EXPECT_NEAR(result.scores.by_step[Rule::best].mse[2], back.steps[3].commanded_mse, 1e-12);
  EXPECT_TRUE(std::isnan(result.scores.uncured_mse[Rule::best])) << "curing shifts nothing";
  EXPECT_THAT(result.scores.by_step[Rule::current].mse, SizeIs(0)) << "equals commanded_mse";
  const TrialResult cured = run("", {0.05, 0, 0});
  EXPECT_NE(cured.scores.by_step[Rule::best].mse[2], result.scores.by_step[Rule::best].mse[2]);
  EXPECT_NEAR(cured.scores.uncured_mse[Rule::best], result.scores.by_step[Rule::best].mse[2], 1e-12);
  TrialFixture linear(R"([["step", 0.45, 0.5, 0.5]])");
  EXPECT_THAT(linear.run().scores.by_step[Rule::best].mse, SizeIs(0));
}

TEST(Recommendation, MayComeAfterTheBudgetIsSpent) {
  TrialFixture trial(R"([["step", 0.4, 0.5, 0.5], ["step", 0.3, 0.5, 0.5], ["recommend", 0.5, 0.5, 0.5]])");
  trial.terms.budget = 1;
  const TrialResult result = trial.run();
  ASSERT_THAT(result.steps, SizeIs(2));
  EXPECT_EQ(trial.logged("answer"), std::vector<Json>{"stop"});
  EXPECT_EQ(result.steps[0].recommendation, "best_measured");
  EXPECT_EQ(result.steps[1].recommendation, "own");
  EXPECT_THAT(result.steps[1].recommended_pose, ElementsAre(0.5, 0.5, 0.5));
  EXPECT_EQ(result.end, End::budget_spent);
}

TEST(Recommendation, MayComeBeforeAnyStep) {
  TrialFixture trial(R"([["recommend", 0.5, 0.5, 0.5]])");
  const TrialResult result = trial.run();
  ASSERT_THAT(result.steps, SizeIs(1));
  EXPECT_EQ(result.steps[0].recommendation, "own");
  EXPECT_EQ(result.end, End::finished);
}

TEST(Recommendation, DefaultsToBestMeasuredPoseForOptimizers) {
  TrialFixture trial(R"([["step", 0.45, 0.5, 0.5], ["step", 0.52, 0.5, 0.5], ["step", 0.7, 0.5, 0.5]])");
  const TrialResult result = trial.run();
  ASSERT_THAT(result.steps, SizeIs(4));
  EXPECT_EQ(result.steps[0].recommended_pose, result.steps[0].commanded_pose);
  EXPECT_EQ(result.steps[1].recommended_pose[0], 0.45);
  EXPECT_EQ(result.steps[2].recommended_pose[0], 0.52);
  EXPECT_EQ(result.steps[3].recommended_pose[0], 0.52);
  for (const Step& step : result.steps) EXPECT_EQ(step.recommendation, "best_measured");
}

TEST(Recommendation, PrefersTheFirstOfEqualMeasurements) {
  TrialFixture trial(R"([["step", 0.25, 0.5, 0.5], ["step", 0.75, 0.5, 0.5]])");
  trial.terms.merit = Merit::rmse;
  trial.instance.perturbations.start = {0.125, 0.5, 0.5};
  const TrialResult result = trial.run();
  ASSERT_EQ(result.steps[1].merit, result.steps[2].merit);
  EXPECT_EQ(result.steps[2].recommended_pose[0], 0.25);
}

TEST(Recommendation, DefaultsToCurrentPoseForAgents) {
  TrialFixture trial(R"([["move", 0.2, 0, 0], ["move", 0.2, 0, 0]])", "fake_agent");
  const TrialResult result = trial.run();
  ASSERT_THAT(result.steps, SizeIs(3));
  for (const Step& step : result.steps) {
    EXPECT_EQ(step.recommendation, "current");
    EXPECT_EQ(step.recommended_pose, step.commanded_pose);
    EXPECT_EQ(step.recommended_true_pose, step.true_pose);
    EXPECT_EQ(step.recommended_seconds, step.machine_seconds);
    EXPECT_EQ(step.recommended_mse, step.commanded_mse);
  }
  EXPECT_THAT(trial.seeds("truth"), SizeIs(3));
}

TEST(Recommendation, CurrentPoseIsExactAtALimit) {
  for (const Limits limits : {Limits::soft, Limits::hard}) {
    TrialFixture trial(R"([["move", 0.7, 0.1, 0.2], ["move", 0.7, 0.1, -0.1]])", "fake_agent");
    trial.terms.protocol = Protocol::blind;
    trial.terms.limits = limits;
    trial.instance.perturbations.distortion = {1.01, 0.02, -0.01, 0.03, 0.98, 0.01, 0, -0.02, 1.02};
    const TrialResult result = trial.run();
    ASSERT_NE(result.steps[2].limits_high, 0u);
    EXPECT_EQ(result.steps[2].recommended_true_pose, result.steps[2].true_pose);
    EXPECT_EQ(result.steps[2].recommended_seconds, result.steps[2].machine_seconds);
  }
}

TEST(Recommendation, RejectsUnusableRecommendationAndKeepsThePrevious) {
  TrialFixture trial(R"([["recommend", 0.5, 0.5, 0.5], ["recommend", "nan", 0, 0], ["recommend", 0.1]])");
  const TrialResult result = trial.run();
  EXPECT_EQ(trial.logged("answer"), (std::vector<Json>{"bad argument", "bad argument"}));
  EXPECT_THAT(result.steps[0].recommended_pose, ElementsAre(0.5, 0.5, 0.5));
}

TEST(OnStep, RunsOncePerCompleteStepWithItsCapture) {
  TrialFixture trial(R"([["first"], ["step", 0.5, 0.58, 0.5], ["recommend", 0.5, 0.5, 0.5], ["step", 0.5, 0.5, 0.6]])");
  std::vector<unsigned> numbers;
  std::vector<std::size_t> captures_before;
  trial.callbacks.on_step = [&](const Step& step, const float* pixels) {
    numbers.push_back(step.step);
    captures_before.push_back(trial.seeds("capture").size());
    EXPECT_NEAR(pixels[5], 0.5 + step.measured, 1e-7) << "the capture of this very step";
    if (step.step == 1) {
      EXPECT_EQ(step.recommendation, "own");
    }
  };
  const TrialResult result = trial.run();
  EXPECT_THAT(numbers, ElementsAre(0, 1, 2));
  EXPECT_THAT(captures_before, ElementsAre(1, 2, 3)) << "before the next capture is made";
  EXPECT_THAT(result.steps, SizeIs(3));
}

}  // namespace
}  // namespace relign::trials
