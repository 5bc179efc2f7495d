#include "records/score_checks.h"

#include <gmock/gmock.h>

#include <functional>

#include "records/sample_records.h"

namespace relign::records {
namespace {

using testing::HasSubstr;

ScoreTerms terms() {
  ScoreTerms made;
  made.axes = 2;
  made.step_seconds = 0.1;
  return made;
}

std::string flaw(const TrialRecord& trial, const ScoreTerms& of = terms()) {
  return flaw_of_scores(trial, numbers_of(trial), of);
}

// "" for the sample; with a change, what is wrong with it.
std::string flaw_with(const std::function<void(TrialRecord&)>& change, const ScoreTerms& of = terms()) {
  TrialRecord trial = sample_trial("a0");
  change(trial);
  return flaw(trial, of);
}

TEST(ScoreChecks, AcceptASample) { EXPECT_EQ(flaw(sample_trial("a0")), ""); }

TEST(ScoreChecks, ErrorsHaveAStandardError) {
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.steps[1].commanded_mse_error = kUnknown; }),
            "has 'commanded_mse' 5e-05 at step 1 with the standard error null");
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.steps[1].recommended_mse_error = -1; }),
            "has 'recommended_mse' 5e-05 at step 1 with the standard error -1");
  EXPECT_EQ(flaw_with([](TrialRecord& of) {
              of.steps[1].recommended_mse = -8e-6;
              of.steps[1].recommended_true_pose[0] = 0.6;  // elsewhere
            }),
            "");
  EXPECT_THAT(flaw_with([](TrialRecord& of) { of.steps[1].recommended_mse = -3e-5; }),
              HasSubstr("-3e-05 at step 1, which is below 0 by more than 10 standard errors"));
}

// For a nearly perfect lens half of the estimates are below the estimated optimum, because of their noise.
TEST(ScoreChecks, ErrorsAreNotClearlyBelowTheOptimum) {
  const auto with = [](double optimum, double last) {
    return flaw_with([&](TrialRecord& of) {
      of.own_optimum.mse = optimum;
      of.steps[2].recommended_mse = last;
      of.steps[2].recommended_true_pose[0] = 0.6;  // elsewhere
    });
  };
  EXPECT_EQ(with(2e-7, -2e-7), "");
  EXPECT_EQ(with(3e-5, 2.8e-5), "");
  EXPECT_EQ(with(3e-5, 1e-5), "has 'recommended_mse' 1e-05 at step 2, clearly below 'own_optimum_mse' 3e-05");
  EXPECT_EQ(flaw_with([](TrialRecord& of) {
              of.own_optimum.mse = 3e-5;
              of.scores.by_step[Rule::best] = {{1e-4, 1e-4, 1e-6}, {1e-7, 1e-7, 1e-7}};
            }),
            "has 'best_mse' 1e-06 at step 2, clearly below 'own_optimum_mse' 3e-05");
}

TEST(ScoreChecks, MeritsIncludeTheMeasuredError) {
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.steps[1].merit += 0.5; }), "")
      << "merits may add the distance to the nominal pose";
  ScoreTerms by_field = terms();
  by_field.merit_has_rmse = false;
  for (const double merit : {-0.1, 0.001}) {
    const auto change = [&](TrialRecord& of) { of.steps[1].merit = merit; };
    EXPECT_THAT(flaw_with(change),
                HasSubstr("has 'merit' " + std::string(merit < 0 ? "-0.1" : "0.001") + " at step 1"));
    EXPECT_EQ(flaw_with(change, by_field).empty(), merit > 0);
  }
}

TEST(ScoreChecks, MeritsAreNumbersThatTheirKindCanHave) {
  const auto with = [](double merit, const ScoreTerms& of = terms()) {
    return flaw_with([&](TrialRecord& trial) { trial.steps[1].merit = merit; }, of);
  };
  EXPECT_EQ(with(kUnknown), "has 'merit' null at step 1; a merit is a number from 0 to 2.414213562373095");
  EXPECT_THAT(with(1e300), HasSubstr("a merit is a number from 0 to"));
  EXPECT_EQ(with(2.4), "") << "1 and the longest distance in two axes";
  ScoreTerms other = terms();
  other.merit_has_rmse = false;
  EXPECT_EQ(with(1, other), "");
  EXPECT_EQ(with(1.5, other), "has 'merit' 1.5 at step 1; a merit is a number from 0 to 1");
  other = terms();
  other.merit_is_rmse = true;
  EXPECT_EQ(with(0.02, other), "");
  EXPECT_EQ(with(0.5, other), "has 'merit' 0.5 at step 1, but it is the measured error, 0.02");
}

TEST(ScoreChecks, ClocksAreKnown) {
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.steps[1].machine_seconds = kUnknown; }),
            "has 'machine_seconds' null at step 1 after 0");
  const auto no_move = [](TrialRecord& of) { of.steps[1].recommended_seconds = kUnknown; };
  EXPECT_EQ(flaw_with(no_move),
            "has 'recommended_seconds' null at step 1; the move to the recommendation begins at 0.1");
  ScoreTerms station = terms();
  station.station = true;
  EXPECT_EQ(flaw_with(no_move, station), "") << "which does not state what a move would take";
}

TEST(ScoreChecks, PosesAreOfTheSceneAndWithinItsTravel) {
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.steps[2].true_pose.push_back(0.5); }),
            "has 'true_pose' of 3 instead of 2 axes at step 2");
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.steps[2].true_pose[0] = -0.2; }),
            "has 'true_pose' outside the travel at step 2");
  const auto unknown = [](TrialRecord& of) { of.steps[2].true_pose[0] = kUnknown; };
  EXPECT_EQ(flaw_with(unknown), "has 'true_pose' with an unknown value at step 2");
  ScoreTerms station = terms();
  station.station = true;
  EXPECT_EQ(flaw_with(unknown, station), "");
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.steps[2].recommended_pose[0] = kUnknown; }),
            "has 'recommended_pose' with an unknown value at step 2");
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.steps[2].commanded_pose[0] = -0.2; }), "") << "relative to the start";
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.own_optimum.pose = {0.5}; }),
            "has 'own_optimum_pose' of 1 instead of 2 axes");
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.steps[2].limits_high = 2; }), "");
  EXPECT_THAT(flaw_with([](TrialRecord& of) { of.steps[2].limits_high = 4; }), HasSubstr("at a limit of an axis"));
}

TEST(ScoreChecks, RecommendationsAreWhatTheyAreCalled) {
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.steps[1].recommendation = "current"; }), "");
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.steps[1].recommendation = "best_measured"; }), "");
  for (const char* name : {"current", "best_measured"}) {
    EXPECT_THAT(flaw_with([&](TrialRecord& of) {
                  of.steps[2].recommendation = name;
                  of.steps[2].recommended_pose = of.steps[0].commanded_pose;
                }),
                HasSubstr("at step 2, but recommends another pose"));
    const auto elsewhere = [&](TrialRecord& of) {
      of.steps[2].recommendation = name;
      of.steps[2].recommended_true_pose[0] = 0.7;
    };
    EXPECT_THAT(flaw_with(elsewhere), HasSubstr("at step 2, but recommends another pose"));
    EXPECT_EQ(flaw_with([&](TrialRecord& of) {
                elsewhere(of);
                of.steps[2].limits_high = 1;
              }),
              "")
        << "a limit may cut a move";
    EXPECT_EQ(flaw_with([&](TrialRecord& of) {
                elsewhere(of);
                of.end = "failed";
              }),
              "")
        << "errors of the stage are unknown";
  }
}

TEST(ScoreChecks, OneTruePoseHasOneError) {
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.steps[2].recommended_mse += 5e-7; }), "");
  EXPECT_EQ(
      flaw_with([](TrialRecord& of) { of.steps[2].recommended_mse /= 100; }),
      "has 'recommended_mse' 3.3333333333333335e-07 at step 2, but 'commanded_mse' 3.3333333333333335e-05 at step 2 at "
      "the same true pose");
}

TEST(ScoreChecks, SharesAreFromZeroToOne) {
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.scores.mtf[Rule::own][Curing::after].centre = 5; }),
            "has 'mtf_centre' 5, which is a share from 0 to 1");
}

TEST(ScoreChecks, AStepTakesTime) {
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.steps[2].machine_seconds = of.steps[2].recommended_seconds = 0.15; }),
            "has 'machine_seconds' 0.15 at step 2 after 0.1, but a step takes at least 0.1");
  ScoreTerms station = terms();
  station.station = true;
  EXPECT_EQ(flaw_with([](TrialRecord& of) { of.steps[2].machine_seconds = 0.15; }, station), "");
}

}  // namespace
}  // namespace relign::records
