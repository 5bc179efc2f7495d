// Algorithms that fail, misuse the trial or do not stop; scenes that fail; runs that are stopped.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cfenv>
#include <filesystem>

#include "trials/fakes.h"

namespace relign::trials {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TEST(Misbehaviour, RejectsUnusablePosesAtNoCost) {
  TrialFixture trial(
      R"([["step", "nan", 0.5, 0.5],
          ["step", 0.5, "inf", 0.5],
          ["step", 0.5, 0.5],
          ["move", 0.1, 0.1, 0.1, 0.1],
          ["move", 0, 0, "-inf"],
          ["step"],
          ["first"],
          ["step", 0.5, 0.5, 0.5]])");
  const TrialResult result = trial.run();
  EXPECT_EQ(trial.logged("answer"), std::vector<Json>(6, "bad argument"));
  ASSERT_THAT(result.steps, SizeIs(2));
  EXPECT_THAT(result.steps[1].commanded_pose, ElementsAre(0.5, 0.5, 0.5));
  EXPECT_NEAR(result.steps[1].machine_seconds, 0.045 + 0.08 + 0.085, 1e-12);
  EXPECT_EQ(result.end, End::finished);
  EXPECT_THAT(trial.seeds("capture"), SizeIs(2));
  EXPECT_EQ(trial.logged("seen").at(0)["step"], 0) << "step 0 is still available after the refusals";
}

TEST(Misbehaviour, RejectsFirstAfterTheFirstStep) {
  TrialFixture trial(R"([["first"], ["first"], ["step", 0.5, 0.5, 0.5], ["first"]])");
  trial.run();
  EXPECT_THAT(trial.logged("seen"), SizeIs(3));
  EXPECT_EQ(trial.logged("answer"), std::vector<Json>{"bad argument"}) << "its image was overwritten";
}

TEST(Misbehaviour, StopsAtTheBudget) {
  TrialFixture trial(R"([["insist", 1000], ["step", 0.5, 0.5, 0.5]])");
  const TrialResult result = trial.run();
  EXPECT_THAT(result.steps, SizeIs(5));
  EXPECT_THAT(trial.seeds("capture"), SizeIs(5));
  EXPECT_EQ(trial.logged("answer"), std::vector<Json>{"stop"});
  EXPECT_EQ(result.end, End::budget_spent);
}

TEST(Misbehaviour, EndsTrialThatKeepsAsking) {
  TrialFixture trial(R"([["insist", 1000000]])");
  const TrialResult result = trial.run();
  EXPECT_EQ(result.end, End::overspent);
  EXPECT_THAT(result.message, HasSubstr("steps beyond the end of the trial"));
  EXPECT_THAT(result.steps, SizeIs(5));

  TrialFixture bad(R"([["insist_badly", 1000000]])");
  const TrialResult refused = bad.run();
  EXPECT_EQ(refused.end, End::failed);
  EXPECT_THAT(refused.message, HasSubstr("bad arguments"));
  EXPECT_THAT(refused.steps, SizeIs(1));
}

TEST(Misbehaviour, FailureKeepsTheStepsSoFar) {
  TrialFixture trial(R"([["step", 0.5, 0.5, 0.5], ["fail"]])");
  const TrialResult result = trial.run();
  EXPECT_EQ(result.end, End::failed);
  EXPECT_THAT(result.message, HasSubstr("fake_optimizer"));
  EXPECT_THAT(result.message, HasSubstr("out of ideas"));
  ASSERT_THAT(result.steps, SizeIs(2));
  EXPECT_GT(result.steps[1].commanded_mse_error, 0) << "the last step is complete";
}

TEST(Misbehaviour, FailureAfterTheLastStepIsAFailure) {
  TrialFixture trial(R"([["insist", 5], ["fail"]])");
  const TrialResult result = trial.run();
  EXPECT_THAT(result.steps, SizeIs(5));
  EXPECT_EQ(result.end, End::failed);
}

TEST(Misbehaviour, FailureToCreateTheAlgorithmLeavesStepZero) {
  TrialFixture trial(R"("refuse_to_be_made")");
  const TrialResult result = trial.run();
  EXPECT_EQ(result.end, End::failed);
  EXPECT_THAT(result.message, HasSubstr("no model file"));
  EXPECT_THAT(result.steps, SizeIs(1));
}

TEST(Misbehaviour, HostKeepsItsRoundingMode) {
  const char* const moves = R"([["step", 0.41, 0.52, 0.53], ["rounding"], ["move", 0.1, 0.1, 0.1]])";
  TrialFixture trial(moves);
  const TrialResult expected = trial.run();

  TrialFixture rounding(std::string(R"([["round_up"], )") + (moves + 1));
  const TrialResult result = rounding.run();
  EXPECT_EQ(std::fegetround(), FE_TONEAREST);
  EXPECT_EQ(rounding.logged("rounding"), std::vector<Json>{"up"}) << "the algorithm keeps its mode while it runs";
  ASSERT_EQ(result.steps.size(), expected.steps.size());
  for (std::size_t k = 0; k < result.steps.size(); ++k) {
    EXPECT_EQ(result.steps[k].measured, expected.steps[k].measured);
    EXPECT_EQ(result.steps[k].true_pose, expected.steps[k].true_pose);
    EXPECT_EQ(result.steps[k].commanded_mse, expected.steps[k].commanded_mse);
  }
  EXPECT_THAT(result.environment_changes, Contains(HasSubstr("rounding")));
}

TEST(Misbehaviour, ReportsAndRevertsChangesOfTheEnvironment) {
  const auto folder = std::filesystem::current_path();
  TrialFixture trial(R"([["leave_folder"]])");
  const TrialResult result = trial.run();
  EXPECT_THAT(result.environment_changes, ElementsAre(HasSubstr("working directory")));
  EXPECT_EQ(std::filesystem::current_path(), folder);
  EXPECT_EQ(result.end, End::finished) << "the result counts in spite of the change";
}

TEST(Stopping, StoppedTrialDoesNotCount) {
  std::atomic<bool> stop{false};
  TrialFixture trial(R"([["step", 0.5, 0.5, 0.5], ["step", 0.5, 0.5, 0.6], ["step", 0.5, 0.5, 0.7], ["fail"]])");
  trial.algorithm_services.stop = &stop;
  trial.callbacks.on_step = [&](const Step& step, const float*) { stop = step.step == 1; };
  const TrialResult result = trial.run();
  EXPECT_EQ(result.end, End::stopped) << "whatever the algorithm does then";
  EXPECT_THAT(result.steps, SizeIs(3)) << "step 2 was in progress when the record of step 1 was completed";
}

TEST(Stopping, CompleteTrialCountsDespiteStop) {
  std::atomic<bool> stop{true};
  TrialFixture trial(R"([["step", 0.5, 0.5, 0.5]])");
  trial.algorithm_services.stop = &stop;
  trial.terms.budget = 0;
  EXPECT_EQ(trial.run().end, End::budget_spent);
  TrialFixture idle("[]");
  idle.algorithm_services.stop = &stop;
  EXPECT_EQ(idle.run().end, End::finished);
}

// The error that run_trial throws.
template <class Expected = Error>
std::string thrown_by(TrialFixture& trial) {
  try {
    trial.run();
  } catch (const Expected& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(SceneFailure, IsNotAttributedToTheAlgorithm) {
  TrialFixture at_start("[]", "fake_optimizer", {{"fail_at", 0}});
  EXPECT_THAT(thrown_by(at_start), HasSubstr("the lamp is out"));
  TrialFixture later(R"([["step", 0.5, 0.5, 0.5], ["step", 0.5, 0.5, 0.5]])", "fake_optimizer", {{"fail_at", 2}});
  EXPECT_THAT(thrown_by(later), HasSubstr("fake_scene"));
  TrialFixture and_algorithm(R"([["step", 0.5, 0.5, 0.5], ["fail"]])", "fake_optimizer", {{"fail_at", 1}});
  EXPECT_THAT(thrown_by(and_algorithm), HasSubstr("the lamp is out"));
}

TEST(SceneFailure, ReportsNonFinitePixels) {
  TrialFixture trial(R"([["step", 0.5, 0.5, 0.5]])", "fake_optimizer", {{"bad_pixel_at", 1}});
  EXPECT_THAT(thrown_by(trial), HasSubstr("step 1 has non-finite pixels"));
}

TEST(SceneFailure, RejectsReferenceOfAnotherSize) {
  TrialFixture trial("[]");
  trial.facts.image_width = 4;
  EXPECT_THAT(thrown_by(trial), HasSubstr("3 x 2 pixels; expected 4 x 2"));
}

TEST(HostFailure, PropagatesExceptionsOfOnStep) {
  TrialFixture trial(R"([["step", 0.5, 0.5, 0.5]])");
  trial.callbacks.on_step = [](const Step&, const float*) { throw Error(ErrorKind::io, "the disk is full"); };
  EXPECT_EQ(thrown_by(trial), "the disk is full");
  TrialFixture other(R"([["step", 0.5, 0.5, 0.5]])");
  other.callbacks.on_step = [](const Step&, const float*) { throw std::length_error("too long"); };
  EXPECT_EQ(thrown_by<std::length_error>(other), "too long");
}

TEST(HostFailure, RejectsStageOfAnotherScene) {
  TrialFixture trial("[]");
  trial.facts.owns_stage = true;
  EXPECT_THAT(thrown_by(trial), HasSubstr("needs the stage of its scene"));
}

}  // namespace
}  // namespace relign::trials
