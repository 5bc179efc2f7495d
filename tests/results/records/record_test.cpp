#include "records/record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "error_text.h"
#include "records/difference.h"
#include "records/step_numbers.h"
#include "sample_records.h"

namespace relign::records {
namespace {

using test::error_text;
using testing::HasSubstr;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines(1);
  for (const char letter : text) {
    if (letter == '\n')
      lines.emplace_back();
    else
      lines.back() += letter;
  }
  return lines;
}

// The closing line has MTF members only where a specification asks for them.
TEST(Record, WritesMtfOnlyWhereMeasured) {
  TrialRecord record = sample_trial("0123456789abcdef");
  EXPECT_THAT(to_lines(record), testing::Not(HasSubstr("mtf")));
  const auto read_back = [&record] { return read_trial_line(lines_of(to_lines(record)).back(), "here").trial; };
  EXPECT_TRUE(std::isnan(read_back().scores.mtf[Rule::own][Curing::after].centre));
  record.scores.mtf[Rule::own][Curing::after] = {0.75, 0.5};
  record.scores.uncured_mse[Rule::own] = 1e-4;
  record.scores.mtf[Rule::own][Curing::before] = {0.8, 0.625};
  record.own_optimum.mtf = {0.875, 1};
  EXPECT_THAT(to_lines(record),
              HasSubstr(R"("own_optimum_mtf_centre":0.875,"own_optimum_mtf_corner":1,"uncured_mse":1e-04,)"
                        R"("mtf_centre":0.75,"mtf_corner":0.5,"uncured_mtf_centre":0.8,"uncured_mtf_corner":0.625,)"
                        R"("message")"));
  const TrialRecord again = read_back();
  EXPECT_EQ(again.scores.mtf[Rule::own][Curing::after].centre, 0.75);
  EXPECT_EQ(again.scores.mtf[Rule::own][Curing::after].corner, 0.5);
  EXPECT_EQ(again.scores.mtf[Rule::own][Curing::before].corner, 0.625);
  EXPECT_EQ(again.own_optimum.mtf.corner, 1);
}

TEST(Record, WritesScoresOfOtherRulesOnlyWhereCuringShiftsTheLens) {
  TrialRecord record = sample_trial("0123456789abcdef");
  EXPECT_THAT(to_lines(record), testing::Not(HasSubstr("glued")));
  record.scores.uncured_mse[Rule::own] = 1e-4;
  record.scores.by_step[Rule::current].mse.assign(record.steps.size(), 0.25);
  record.scores.by_step[Rule::current].error.assign(record.steps.size(), 0.5);
  record.scores.mtf[Rule::own][Curing::after] = {0.75, 0.5};
  record.scores.mtf[Rule::best][Curing::after] = {0.5, 0.25};
  record.scores.mtf[Rule::current][Curing::before] = {0.125, 0};
  const TrialRecord again = read_trial_line(lines_of(to_lines(record)).back(), "here").trial;
  EXPECT_EQ(again.scores.by_step[Rule::current].mse, record.scores.by_step[Rule::current].mse);
  EXPECT_EQ(again.scores.by_step[Rule::current].error, record.scores.by_step[Rule::current].error);
  EXPECT_EQ(again.scores.mtf[Rule::best][Curing::after].corner, 0.25);
  EXPECT_EQ(again.scores.mtf[Rule::current][Curing::before].centre, 0.125);
  record.scores.by_step[Rule::current].mse.pop_back();
  EXPECT_THROW(read_trial_line(lines_of(to_lines(record)).back(), "here"), Error);
}

TEST(Record, WritesScoresOfMovesBackOnlyWhereTheStageHasErrors) {
  TrialRecord record = sample_trial("0123456789abcdef");
  EXPECT_THAT(to_lines(record), testing::Not(HasSubstr("best_mse")));
  record.scores.by_step[Rule::best].mse.assign(record.steps.size(), 0.25);
  record.scores.by_step[Rule::best].error.assign(record.steps.size(), 0.5);
  record.scores.uncured_mse[Rule::best] = 0.125;
  TrialRecord again = read_trial_line(lines_of(to_lines(record)).back(), "here").trial;
  again.steps = record.steps;
  EXPECT_EQ(to_lines(again), to_lines(record));
  EXPECT_EQ(again.scores.uncured_mse[Rule::best], 0.125);
  EXPECT_FALSE(first_difference(record, again, 0));
  again.scores.by_step[Rule::best].mse.back() = 0.375;
  ASSERT_TRUE(first_difference(record, again, 0));
  EXPECT_THAT(first_difference(record, again, 0)->field, HasSubstr("best_mse"));
  std::vector<StepNumbers> steps(record.steps.size());
  set_scores(record, steps);
  EXPECT_EQ(steps.back().best_mse, 0.25);
  record.scores.by_step[Rule::best].mse.pop_back();
  EXPECT_THROW(read_trial_line(lines_of(to_lines(record)).back(), "here"), Error);
}

// The examples of results/README.md, byte for byte.
TEST(Record, KeepsCriteriaOnlyWhereTheyAreLimited) {
  TrialRecord record = sample_trial("t1");
  EXPECT_THAT(closing_line(record, 3), testing::Not(HasSubstr("criterion")));
  EXPECT_THAT(closing_line(record, 3), testing::Not(HasSubstr("_px")));
  record.criteria[criterion_named("centre_px")] = {3, std::nan(""), 0.125};
  record.criterion_optimum_pose = {0.5, 0.25};
  record.criterion_optimum_deficit = -0.1;
  const std::string line = closing_line(record, 3);
  EXPECT_THAT(line, HasSubstr(R"("centre_px":[3,null,0.125],"criterion_optimum_pose":[0.5,0.25])"));
  const TrialRecord read = read_trial_line(line, "here").trial;
  EXPECT_EQ(closing_line(read, 3), line);
  EXPECT_TRUE(read.criteria[criterion_named("tilt_arcmin")].empty());
  EXPECT_THROW(read_trial_line(closing_line(record, 2), "here"), Error) << "three values of two steps";
}

TEST(Specification, CompletesTheLimitsOfFields) {
  const Json spec = Json::parse(R"({"field_mtf": {"lp_per_mm": 50, "tangential": 0.4, "sagittal": 0.3,
                                    "fields": ["left", {"name": "centre", "tangential": 0.6}]}, "pose_um": 2})");
  const Specification found = specification_of(spec, Json(), SceneScore());
  ASSERT_EQ(found.field_mtf.fields.size(), 2U);
  EXPECT_EQ(found.field_mtf.fields[0].name, "left");
  EXPECT_EQ(found.field_mtf.fields[0].tangential, 0.4);
  EXPECT_EQ(found.field_mtf.fields[1].name, "centre");
  EXPECT_EQ(found.field_mtf.fields[1].tangential, 0.6);
  EXPECT_EQ(found.field_mtf.fields[1].sagittal, 0.3);
  ByCriterion<double> values = Specification::none();
  EXPECT_FALSE(found.criteria_met_by(values)) << "unknown";
  values[Criterion::field_mtf] = 0;
  values[criterion_named("pose_um")] = 2;
  EXPECT_TRUE(found.criteria_met_by(values));
  values[Criterion::field_mtf] = 1e-9;
  EXPECT_FALSE(found.criteria_met_by(values));
  EXPECT_FALSE(specification_of(Json::parse(R"({"rmse": 0.1})"), spec, SceneScore()).limits_criteria())
      << "the suite's replaces it";
}

TEST(Record, WritesTheExamplesOfTheFormat) {
  TrialRecord record;
  record.trial = "4f1c0a9b2d3e4f50";
  record.end = "budget_spent";
  record.budget = 30;
  record.scene = "relign_od";
  record.noise_level = "rho0.25";
  record.protocol = "paper";
  record.algorithm = record.algorithm_id = "nlopt-sbplx";
  record.instance = 7;
  record.instance_seed = 1234567890123456789U;
  StepRecord step;
  step.step = 3;
  step.commanded_pose = step.recommended_pose = {0.5};
  step.true_pose = step.recommended_true_pose = {0.501};
  step.merit = step.measured = 0.041;
  step.machine_seconds = step.recommended_seconds = 0.62;
  step.recommendation = "own";
  step.commanded_mse = step.recommended_mse = 2.1e-4;
  step.commanded_mse_error = step.recommended_mse_error = 1.5e-7;
  record.steps = {step};
  EXPECT_EQ(to_lines(record),
            R"({"trial":"4f1c0a9b2d3e4f50","step":3,"commanded_pose":[0.5],"true_pose":[0.501],"limits_low":0,)"
            R"("limits_high":0,"merit":0.041,"measured":0.041,"machine_seconds":0.62,"recommended_pose":[0.5],)"
            R"("recommendation":"own","recommended_seconds":0.62,"recommended_true_pose":[0.501],)"
            R"("commanded_mse":0.00021,"commanded_mse_error":1.5e-07,"recommended_mse":0.00021,)"
            R"("recommended_mse_error":1.5e-07})"
            "\n"
            R"({"format":1,"trial":"4f1c0a9b2d3e4f50","end":"budget_spent","steps":1,"budget":30,)"
            R"("scene":"relign_od","noise_level":"rho0.25","protocol":"paper","algorithm":"nlopt-sbplx",)"
            R"("algorithm_id":"nlopt-sbplx","instance":7,"instance_seed":"1234567890123456789",)"
            R"("own_optimum_mse":null,"own_optimum_pose":[],"message":"","warnings":[]})");
}

TEST(Record, ReadsBackBitForBit) {
  TrialRecord record = sample_trial("0123456789abcdef", 1);
  record.message = "line one\nline \"two\"\t\xc3\xbc";
  record.warnings = {"compass: left the working directory at /"};
  record.own_optimum.mse = -1.1102230246251565e-16;
  record.own_optimum.pose = {0.1, 1 / 3.0};
  record.scores.uncured_mse[Rule::own] = 1 / 7.0;
  record.steps[1].commanded_pose = {0.1 + 0.2, -0.0};
  record.steps[1].limits_low = 18446744073709551615U;
  record.steps[1].limits_high = 9223372036854775808U;
  record.steps[1].measured = std::numeric_limits<double>::denorm_min();
  const auto lines = lines_of(to_lines(record));
  ASSERT_EQ(lines.size(), 3U);
  const ReadLine step = read_trial_line(lines[1], "x:2");
  EXPECT_FALSE(step.closing);
  EXPECT_EQ(step.trial.trial, record.trial);
  EXPECT_EQ(step.step.commanded_pose[0], 0.30000000000000004);
  EXPECT_TRUE(std::signbit(step.step.commanded_pose[1]));
  EXPECT_EQ(step.step.limits_low, record.steps[1].limits_low);
  EXPECT_EQ(step.step.limits_high, record.steps[1].limits_high);
  EXPECT_EQ(step.step.measured, record.steps[1].measured);
  const ReadLine closing = read_trial_line(lines[2], "x:3");
  ASSERT_TRUE(closing.closing);
  EXPECT_EQ(closing.steps, 2U);
  EXPECT_EQ(closing.trial.message, record.message);
  EXPECT_EQ(closing.trial.warnings, record.warnings);
  EXPECT_EQ(closing.trial.instance_seed, record.instance_seed);
  EXPECT_EQ(closing.trial.own_optimum.mse, record.own_optimum.mse);
  EXPECT_EQ(closing.trial.own_optimum.pose, record.own_optimum.pose);
  EXPECT_EQ(closing.trial.scores.uncured_mse[Rule::own], record.scores.uncured_mse[Rule::own]);
}

TEST(Record, WritesRegionsOnlyOfCapturesOfRegions) {
  TrialRecord record = sample_trial("0123456789abcdef", 1);
  record.steps[1].regions = {{1, 2, 3, 4}, {50, 60, 128, 128}};
  record.steps[1].measured = std::numeric_limits<double>::quiet_NaN();
  const auto lines = lines_of(to_lines(record));
  EXPECT_THAT(lines[0], testing::Not(HasSubstr("regions")));
  EXPECT_THAT(lines[1], HasSubstr(R"("measured":null,"regions":[[1,2,3,4],[50,60,128,128]],"machine_seconds":)"));
  EXPECT_EQ(read_trial_line(lines[1], "x:2").step.regions, record.steps[1].regions);
  EXPECT_TRUE(read_trial_line(lines[0], "x:1").step.regions.empty());
  std::string damaged = lines[1];
  damaged.replace(damaged.find("[1,2,3,4]"), 9, "[1,2,3]");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_trial_line(damaged, "f:2"); }),
              testing::AllOf(testing::StartsWith("f:2"), HasSubstr("[column, row, columns, rows]")));
}

TEST(Record, WritesNonFiniteAsNullAndReadsItAsNaN) {
  TrialRecord record = sample_trial("0123456789abcdef", 0);
  record.steps[0].merit = std::numeric_limits<double>::infinity();
  record.steps[0].true_pose = {std::numeric_limits<double>::quiet_NaN(), 1};
  const auto lines = lines_of(to_lines(record));
  EXPECT_THAT(lines[0], HasSubstr("\"merit\":null"));
  EXPECT_THAT(lines[0], HasSubstr("\"true_pose\":[null,1]"));
  const StepRecord step = read_trial_line(lines[0], "x:1").step;
  EXPECT_TRUE(std::isnan(step.merit));
  EXPECT_TRUE(std::isnan(step.true_pose[0]));
  EXPECT_EQ(step.true_pose[1], 1);
}

TEST(Record, WritesMessagesOfInvalidUtf8) {
  TrialRecord record = sample_trial("0123456789abcdef", 0);
  record.message = "bad \xff byte";
  const auto lines = lines_of(to_lines(record));
  EXPECT_THAT(read_trial_line(lines[1], "x").trial.message, HasSubstr("bad"));
}

TEST(Record, RejectsNewerFormatsAndDamageWithPosition) {
  std::string closing = lines_of(to_lines(sample_trial("0123456789abcdef", 0)))[1];
  closing.replace(closing.find(":1,"), 3, ":2,");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_trial_line(closing, "trials/0000.jsonl:7"); }),
              testing::AllOf(testing::StartsWith("trials/0000.jsonl:7"), HasSubstr("newer")));
  EXPECT_THAT(error_text(ErrorKind::bad_input, [] { read_trial_line("{\"trial\":\"a\",\"st", "f:1"); }),
              testing::StartsWith("f:1: the line is damaged"));
  EXPECT_THAT(error_text(ErrorKind::bad_input, [] { read_trial_line("{\"trial\":\"a\",\"step\":1}", "f:1"); }),
              HasSubstr("commanded_pose"));
}

// A report allocates memory for every step of the budget.
TEST(Record, RejectsMoreStepsThanTheLimit) {
  TrialRecord record = sample_trial("0123456789abcdef", 0);
  record.budget = 4'000'000'000U;
  EXPECT_THAT(
      error_text(ErrorKind::bad_input, [&] { read_trial_line(lines_of(to_lines(record))[1], "f:2"); }),
      testing::AllOf(testing::StartsWith("f:2"), HasSubstr("found step 4000000000; a trial has at most 100000")));
  record.steps[0].step = 100'001;
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_trial_line(lines_of(to_lines(record))[0], "f:1"); }),
              HasSubstr("found step 100001"));
}

TEST(Times, ReadBack) {
  const TrialTimes times = read_times_line(to_line(sample_times("0123456789abcdef")), "x:1");
  EXPECT_EQ(times.trial, "0123456789abcdef");
  EXPECT_THAT(times.algorithm_seconds, testing::ElementsAre(0.25, 0.25, 0.25));
  EXPECT_THAT(times.simulation_seconds, testing::ElementsAre(0.5, 0.5, 0.5));
  EXPECT_THAT(times.truth_seconds, testing::ElementsAre(1, 1, 1));
  EXPECT_EQ(times.plugins.noise_level, "b2");
}

}  // namespace
}  // namespace relign::records
