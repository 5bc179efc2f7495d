#include "statistics/study.h"

#include <gmock/gmock.h>

#include <cmath>

#include "statistics/made_table.h"
#include "statistics/order_statistic.h"
#include "statistics/proportion.h"

namespace relign::statistics {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::IsNan;

class StudyTest : public MadeTable {
 protected:
  // A trial with these RMSE at the recommended pose per step, half a simulated second each.
  static records::TrialRecord trial(const std::string& algorithm, std::uint64_t instance,
                                    const std::vector<double>& rmse, unsigned budget, double own_optimum = 0.001) {
    records::TrialRecord record;
    record.trial = algorithm + std::to_string(instance);
    record.scene = "toy";
    record.noise_level = "calm";
    record.protocol = "paper";
    record.algorithm = record.algorithm_id = algorithm;
    record.instance = instance;
    record.end = rmse.size() == budget + 1U ? "budget_spent" : "finished";
    record.budget = budget;
    record.own_optimum.mse = own_optimum * own_optimum;
    record.own_optimum.pose = {0.5, 0.25};
    for (std::size_t number = 0; number < rmse.size(); ++number) {
      records::StepRecord step;
      step.step = static_cast<unsigned>(number);
      step.measured = rmse[number];
      step.commanded_mse = step.recommended_mse = rmse[number] * rmse[number];
      step.machine_seconds = step.recommended_seconds = 0.5 * static_cast<double>(number);
      step.recommendation = "own";
      step.recommended_true_pose = {0.5 + rmse[number], 0.25 - 2 * rmse[number]};
      record.steps.push_back(step);
    }
    return record;
  }
  static std::vector<records::TrialRecord> two_methods(double factor, std::uint64_t instances = 20) {
    std::vector<records::TrialRecord> trials;
    for (std::uint64_t i = 0; i < instances; ++i) {
      const double lens = 0.01 * (1 + 0.1 * static_cast<double>(i));
      const double wobble = i % 2 == 0 ? 1.02 : 0.98;
      trials.push_back(trial("a", i, {0.1, lens}, 1));
      trials.push_back(trial("b", i, {0.1, lens * factor * wobble}, 1));
    }
    return trials;
  }
};

TEST_F(StudyTest, ComputesYieldAndStepsToSpecification) {
  StudyOptions options;
  options.spec.score = 0.02;
  records::TrialRecord failed = trial("a", 3, {0.1}, 4);
  failed.end = "timeout";
  const Study study = make_study(table({trial("a", 0, {0.1, 0.05, 0.02, 0.01, 0.01}, 4), trial("a", 1, {0.1, 0.015}, 4),
                                        trial("a", 2, {0.1, 0.05, 0.04, 0.03, 0.03}, 4, 0.025), failed}),
                                 options);
  const SeriesStudy& a = study.series.at(0);
  EXPECT_EQ(a.in_spec, 2U);
  EXPECT_EQ(a.yield.n, 4U) << "a failed trial is not in specification";
  EXPECT_EQ(a.yield.interval.low, success_rate(2, 4).interval.low);
  EXPECT_EQ(a.expected_to_spec.successes, 2U);
  EXPECT_EQ(a.expected_to_spec.steps, (2 + 1 + 4) / 2.0);
  EXPECT_EQ(a.steps_to_spec.estimate, 2) << "one of three after one step, two of three after two";
  EXPECT_EQ(a.seconds_to_spec.estimate, 1);
  const GroupStudy& group = study.groups.at(0);
  EXPECT_EQ(group.cannot_meet_spec, 1U);
  EXPECT_THAT(group.infeasible, ElementsAre(2));
  EXPECT_DOUBLE_EQ(group.own_optimum.median, 0.001);
  // |0.01|, |0.015|, |0.03| along the first axis, twice that along the second.
  ASSERT_EQ(a.residual.size(), 2U);
  EXPECT_THAT(a.residual[0].median, DoubleNear(0.015, 1e-12));
  EXPECT_THAT(a.residual[1].median, DoubleNear(0.03, 1e-12));
}

// Limits: deficit 0, centre 2 px, RMSE 0.05.
TEST_F(StudyTest, CountsImagesToEachCriterionAndToAllAtOnce) {
  StudyOptions options;
  options.spec.score = 0.05;
  options.spec.limits[Criterion::field_mtf] = 0;
  options.spec.limits[criterion_named("centre_px")] = 2;
  std::vector<records::TrialRecord> trials = {trial("a", 0, {0.1, 0.05, 0.02, 0.01}, 3),
                                              trial("a", 1, {0.1, 0.02, 0.02, 0.02}, 3), trial("a", 2, {0.1, 0.09}, 3)};
  trials[0].criteria[Criterion::field_mtf] = {0.3, -0.1, 0.1, -0.2};
  trials[0].criteria[criterion_named("centre_px")] = {3, 3, 1, 2};
  trials[1].criteria[Criterion::field_mtf] = {0.2, 0.0, -0.1, 0.01};
  trials[1].criteria[criterion_named("centre_px")] = {1, 9, 1, 1};
  trials[2].criteria[Criterion::field_mtf] = {0.2, std::nan("")};
  trials[2].criteria[criterion_named("centre_px")] = {5, 5};
  trials[0].criterion_optimum_deficit = trials[1].criterion_optimum_deficit = -0.3;
  trials[0].criterion_optimum_pose = trials[1].criterion_optimum_pose = trials[2].criterion_optimum_pose = {0.5, 0.5};
  trials[2].criterion_optimum_deficit = 0.05;  // no pose of this lens meets the limits
  records::TrialRecord failed = trial("a", 3, {0.1}, 3);
  failed.end = "timeout";
  failed.criteria[criterion_named("centre_px")] = {1};
  trials.push_back(failed);
  const TrialTable made = table(trials);
  const Study study = make_study(made, options);
  const SeriesStudy& a = study.series.at(0);
  ASSERT_EQ(a.to_specification.size(), 4U);
  const auto expect = [&](std::size_t which, const char* name, std::size_t in_spec, double steps, double expected) {
    const ArrivalStudy& found = a.to_specification[which];
    EXPECT_EQ(found.name, name);
    EXPECT_EQ(found.in_spec, in_spec) << name;
    EXPECT_EQ(found.share.n, 4U) << "the failed trial misses";
    EXPECT_EQ(found.steps.estimate, steps) << name;
    EXPECT_EQ(found.seconds.estimate, steps / 2) << name;
    EXPECT_EQ(found.expected.steps, expected) << name;
  };
  expect(0, "rmse", 2, 1, (1 + 1 + 3) / 2.0);
  expect(1, "field_mtf_deficit", 1, 1, (1 + 1 + 3) / 2.0);
  expect(2, "centre_px", 2, 2, (2 + 0 + 3) / 2.0);
  expect(3, "all", 1, 3, (3 + 2 + 3) / 2.0);
  EXPECT_EQ(a.in_spec, 1U);
  EXPECT_EQ(a.yield.n, 4U);
  EXPECT_EQ(a.steps_to_spec.estimate, 3);
  EXPECT_EQ(a.rules[Rule::best].yield.n, 0U) << "criteria are judged at the own recommendation";
  EXPECT_THAT(study.groups.at(0).infeasible, ElementsAre(2));
  EXPECT_THAT(a.residual.at(1).median, DoubleNear(0.29, 1e-12)) << "from the optimum of the criterion";
  const CurvePoint& last = a.curve.points.at(3);
  EXPECT_DOUBLE_EQ(last.in_spec, 1 / 3.0);
  EXPECT_EQ(last.criteria[criterion_named("centre_px")], 2);
  std::string csv;
  instances_csv(made, [&](std::string_view text) { csv += text; });
  std::string keys, first, lost;
  for (const Criterion one : kCriteria) {
    if (is_further_score(one)) continue;  // of a scene that declares none
    const CriterionEntry& entry = entry_of(one);
    keys += "," + std::string(entry.column);
    first += entry.column == "field_mtf_deficit" ? ",-0.2" : entry.column == "centre_px" ? ",2" : ",";
    lost += ",";
  }
  EXPECT_THAT(csv, testing::HasSubstr(keys + ",criterion_optimum_deficit\n"));
  EXPECT_THAT(csv, testing::HasSubstr(first + ",-0.3\n"));
  EXPECT_THAT(csv, testing::ContainsRegex("timeout,0,3,,,,,,[^\n]*,," + lost + ",\n")) << "no scores of a failed trial";
  EXPECT_THAT(curves_csv({a.curve}), testing::HasSubstr(",tilt_arcmin_median,in_spec\n"));
  options.rule = Rule::best;
  EXPECT_TRUE(make_study(made, options).series.at(0).to_specification.empty());
}

TEST_F(StudyTest, YieldNeedsRmseAndMtf) {
  StudyOptions options;
  options.spec.score = 0.02;
  options.spec.lp_per_mm = 20;
  options.spec.mtf_centre = 0.5;
  options.spec.mtf_corner = 0.3;
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 5; ++i) trials.push_back(trial("a", i, {0.1, 0.05, 0.01}, 4));
  trials[0].scores.mtf[Rule::own][Curing::after] = {0.5, 0.3};   // exactly at the limits
  trials[1].scores.mtf[Rule::own][Curing::after] = {0.49, 0.9};  // not in the centre
  trials[2].scores.mtf[Rule::own][Curing::after] = {0.9, 0.29};  // not in the corners
  trials[3].scores.mtf[Rule::own][Curing::after] = {0.9, 0.9};
  trials[3].steps.back().recommended_mse = 0.03 * 0.03;  // the error is not in spec
  // The last one has no MTF: unmeasured is not in spec.
  for (std::size_t i = 0; i < 4; ++i) {
    trials[i].scores.uncured_mse[Rule::own] = 1e-4;
    trials[i].scores.mtf[Rule::own][Curing::before] = {0.6, 0.6};
    trials[i].own_optimum.mtf = {0.6, i == 0 || i == 2 ? 0.2 : 0.6};
  }
  const Study study = make_study(table(trials), options);
  const SeriesStudy& a = study.series.at(0);
  EXPECT_EQ(a.in_spec, 1U);
  EXPECT_EQ(a.yield.n, 5U);
  EXPECT_EQ(a.in_spec_uncured, 4U);
  EXPECT_EQ(a.yield_uncured.n, 4U);
  EXPECT_EQ(a.mtf_centre.n, 4U);
  EXPECT_DOUBLE_EQ(a.mtf_centre.median, 0.7);
  EXPECT_DOUBLE_EQ(a.mtf_corner.median, 0.6);
  EXPECT_EQ(a.expected_to_spec.successes, 1U) << "trials whose MTF misses count as not reached";
  EXPECT_EQ(study.groups.at(0).cannot_meet_spec, 1U)
      << "instance 0 misses at its own optimum, but a method brought it in";
  EXPECT_THAT(study.groups.at(0).infeasible, ElementsAre(2));

  options.spec.score = kMissing;
  const Study of_mtf_alone = make_study(table(trials), options);
  EXPECT_EQ(of_mtf_alone.series.at(0).in_spec, 2U);
  EXPECT_EQ(of_mtf_alone.series.at(0).expected_to_spec.trials, 0U) << "MTF is not known per step";

  options.spec = {};
  options.spec.score = 0.02;
  options.spec.lp_per_mm = 20;  // measured, without a limit
  EXPECT_EQ(make_study(table(trials), options).series.at(0).in_spec, 4U);
}

TEST_F(StudyTest, HasNoYieldWithoutTheRequiredMtf) {
  StudyOptions options;
  options.spec.score = 0.02;
  options.spec.lp_per_mm = 20;
  options.spec.mtf_centre = 0.5;
  EXPECT_EQ(make_study(table({trial("a", 0, {0.1, 0.01}, 1)}), options).series.at(0).yield.n, 0U);
}

TEST_F(StudyTest, HasNoYieldWithoutGroundTruth) {
  StudyOptions options;
  options.spec.score = 0.02;
  std::vector<records::TrialRecord> trials = {trial("a", 0, {0.1, 0.01}, 1), trial("a", 1, {0.1, 0.01}, 1)};
  for (records::TrialRecord& each : trials)
    for (records::StepRecord& step : each.steps) step.commanded_mse = step.recommended_mse = kMissing;
  EXPECT_EQ(make_study(table(trials), options).series.at(0).yield.n, 0U);
}

TEST_F(StudyTest, HasYieldZeroIfAllTrialsFail) {
  StudyOptions options;
  options.spec.score = 0.02;
  std::vector<records::TrialRecord> trials = {trial("a", 0, {0.01}, 3), trial("a", 1, {0.01}, 3)};
  for (records::TrialRecord& each : trials) each.end = "timeout";
  const Study study = make_study(table(trials), options);
  EXPECT_EQ(study.series.at(0).yield.n, 2U);
  EXPECT_EQ(study.series.at(0).yield.estimate, 0);
  EXPECT_TRUE(std::isnan(study.series.at(0).expected_to_spec.steps));
}

// One of four reaches the specification after a second; the others give up earlier or run out of steps later.
TEST_F(StudyTest, DoesNotRewardGivingUpEarly) {
  StudyOptions options;
  options.spec.score = 0.02;
  const Study study = make_study(table({trial("a", 0, {0.1, 0.05, 0.01, 0.01}, 3), trial("a", 1, {0.1, 0.05}, 3),
                                        trial("a", 2, {0.1, 0.05}, 3), trial("a", 3, {0.1, 0.05, 0.05, 0.05}, 3)}),
                                 options);
  EXPECT_TRUE(std::isinf(study.series.at(0).steps_to_spec.estimate));
  EXPECT_TRUE(std::isinf(study.series.at(0).seconds_to_spec.estimate));
}

TEST_F(StudyTest, TargetsReachedMatchTheRuntimeEcdf) {
  StudyOptions options;
  options.targets = {0.06, 0.03, 0.012};
  const std::vector<std::vector<double>> rmse = {{0.1, 0.05, 0.02, 0.01}, {0.1, 0.08, 0.04, 0.04}};
  const Study study = make_study(table({trial("a", 0, rmse[0], 3), trial("a", 1, rmse[1], 3)}), options);
  std::vector<TargetTime> pairs;
  for (const std::vector<double>& track : rmse)
    for (const TargetTime& time : times_to_targets(track, options.targets, 3)) pairs.push_back(time);
  EXPECT_EQ(study.series.at(0).targets_reached, runtime_ecdf(pairs, {0, 1, 2, 3}));
  EXPECT_THAT(study.series.at(0).targets_reached,
              ElementsAre(0, DoubleNear(1 / 6.0, 1e-12), 0.5, DoubleNear(4 / 6.0, 1e-12)));
}

TEST_F(StudyTest, BandsContainTheMedian) {
  const Study study = make_study(table(two_methods(2)), {});
  EXPECT_EQ(study.resamples, kResamples);
  const SeriesStudy& a = study.series.at(0);
  const CurvePoint& last = a.curve.points.back();
  const auto track = static_cast<std::size_t>(Track::recommended);
  EXPECT_LT(last.bands[track].low, last.tracks[track].median);
  EXPECT_GT(last.bands[track].high, last.tracks[track].median);
  EXPECT_EQ(a.recommended_median.estimate, last.tracks[track].median);
  EXPECT_EQ(a.recommended_median.interval.low, last.bands[track].low) << "the same draws";
  EXPECT_EQ(last.machine_seconds, 0.5);
  StudyOptions none;
  none.resamples = 0;
  EXPECT_THAT(make_study(table(two_methods(2)), none).series.at(0).curve.points.back().bands[track].low, IsNan());
}

TEST_F(StudyTest, IsIndependentOfThreads) {
  const TrialTable trials = table(two_methods(2));
  const auto csv = [&](unsigned threads) {
    StudyOptions options;
    options.threads = threads;
    std::vector<Curve> curves;
    for (const SeriesStudy& series : make_study(trials, options).series) curves.push_back(series.curve);
    return curves_csv(curves);
  };
  EXPECT_EQ(csv(1), csv(5));
}

TEST_F(StudyTest, ComparesMethodsInPairs) {
  const auto verdict = [&](double factor) {
    const Study study = make_study(table(two_methods(factor)), {});
    EXPECT_EQ(study.groups.at(0).pairs.size(), 1U);
    return study.groups.at(0).pairs.at(0);
  };
  const PairStudy worse = verdict(2);
  EXPECT_EQ(worse.first, 0U) << "the better method first";
  EXPECT_EQ(worse.comparison.verdict, Verdict::better);
  EXPECT_NEAR(std::exp(worse.comparison.difference.estimate), 0.5, 0.01);
  EXPECT_EQ(verdict(1).comparison.verdict, Verdict::practically_equal);
  const PairStudy better = verdict(0.5);
  EXPECT_EQ(better.first, 1U);
  EXPECT_EQ(better.comparison.verdict, Verdict::better);
  // Errors below the resolution are equal, however large their ratio.
  std::vector<records::TrialRecord> tiny;
  for (std::uint64_t i = 0; i < 20; ++i) {
    tiny.push_back(trial("a", i, {0.1, 1e-6}, 1));
    tiny.push_back(trial("b", i, {0.1, 9e-5}, 1));
  }
  EXPECT_EQ(make_study(table(tiny), {}).groups.at(0).pairs.at(0).comparison.verdict, Verdict::practically_equal);
}

TEST_F(StudyTest, ComparesManyMethodsWithTheBestOnly) {
  std::vector<records::TrialRecord> trials;
  for (char method = 'a'; method < 'a' + 14; ++method)
    for (std::uint64_t i = 0; i < 4; ++i)
      trials.push_back(trial(std::string(1, method), i, {0.1, 0.001 * (method - 'a' + 1)}, 1));
  const Study study = make_study(table(trials), {});
  ASSERT_EQ(study.groups.at(0).pairs.size(), 13U);
  for (const PairStudy& pair : study.groups.at(0).pairs) EXPECT_EQ(pair.first, 0U);
}

TEST_F(StudyTest, HandlesOneInstanceAndFailuresOnly) {
  const Study one = make_study(table({trial("a", 0, {0.1, 0.01}, 1), trial("b", 0, {0.1, 0.02}, 1)}), {});
  EXPECT_EQ(one.groups.at(0).pairs.at(0).comparison.verdict, Verdict::undecided);
  EXPECT_FALSE(one.series.at(0).recommended_median.interval.exists());
  records::TrialRecord failed = trial("a", 0, {0.1}, 1);
  failed.end = "failed";
  const Study none = make_study(table({failed}), {});
  EXPECT_TRUE(none.series.at(0).curve.points.empty());
  EXPECT_TRUE(none.groups.at(0).pairs.empty());
  EXPECT_TRUE(make_study(table({}), {}).groups.empty());
}

TEST(BandSteps, IncludeTheFirstAndTheLast) {
  EXPECT_THAT(band_steps(0), ElementsAre(0));
  EXPECT_THAT(band_steps(3), ElementsAre(0, 1, 2, 3));
  for (const unsigned last : {15U, 16U, 50U, 1000U}) {
    const std::vector<unsigned> steps = band_steps(last);
    EXPECT_EQ(steps.size(), kBandSteps) << last;
    EXPECT_EQ(steps.front(), 0U);
    EXPECT_EQ(steps.back(), last);
  }
}

TEST(Targets, SpanTwoDecades) {
  const std::vector<double> targets = default_targets();
  ASSERT_EQ(targets.size(), 31U);
  EXPECT_DOUBLE_EQ(targets.front(), 0.05);
  EXPECT_DOUBLE_EQ(targets.back(), 0.0005);
  for (std::size_t i = 1; i < targets.size(); ++i)
    EXPECT_NEAR(targets[i - 1] / targets[i], std::pow(100, 1 / 30.0), 1e-12);
}

}  // namespace
}  // namespace relign::statistics
