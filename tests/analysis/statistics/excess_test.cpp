#include "statistics/excess.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "statistics/bootstrap.h"
#include "statistics/made_table.h"
#include "statistics/rmse.h"
#include "statistics/study.h"

namespace relign::statistics {
namespace {

using testing::DoubleEq;
using testing::ElementsAre;
using testing::IsNan;

constexpr double kNoOptimum = std::numeric_limits<double>::quiet_NaN();
// Errors are sides of right triangles: 0.13 above 0.05 is 0.12, 0.25 above 0.07 is 0.24.
constexpr double kToyOptimum = 0.05;

class Excess : public MadeTable {
 protected:
  // One value per step: RMSE at the recommended and at the commanded pose, and measured.
  static records::TrialRecord trial(std::uint64_t instance, const std::vector<double>& recommended,
                                    const std::vector<double>& commanded, const std::vector<double>& measured,
                                    unsigned budget) {
    records::TrialRecord record;
    record.trial = "trial-" + std::to_string(instance);
    record.scene = "toy";
    record.noise_level = "calm";
    record.protocol = "blind";
    record.algorithm = record.algorithm_id = "a";
    record.instance = instance;
    record.end = recommended.size() == budget + 1U ? "budget_spent" : "finished";
    record.budget = budget;
    record.own_optimum.mse = kToyOptimum * kToyOptimum;
    for (std::size_t number = 0; number < recommended.size(); ++number) {
      records::StepRecord& step = record.steps.emplace_back();
      step.step = static_cast<unsigned>(number);
      step.measured = measured[number];
      step.commanded_mse = commanded[number] * commanded[number];
      step.recommended_mse = recommended[number] * recommended[number];
    }
    return record;
  }
  static records::TrialRecord constant(std::uint64_t instance, double rmse, unsigned steps, unsigned budget) {
    const std::vector<double> values(steps + std::size_t{1}, rmse);
    return trial(instance, values, values, values, budget);
  }
  static double above(double rmse) { return std::sqrt(rmse * rmse - kToyOptimum * kToyOptimum); }
};

TEST_F(Excess, IsReportedAfterCommonNumbersOfImagesAndTheLast) {
  EXPECT_THAT(excess_images(0), ElementsAre(0));
  EXPECT_THAT(excess_images(4), ElementsAre(4));
  EXPECT_THAT(excess_images(6), ElementsAre(6)) << "the last once";
  EXPECT_THAT(excess_images(14), ElementsAre(6, 12, 14));
  EXPECT_THAT(excess_images(50), ElementsAre(6, 12, 50));
  EXPECT_THAT(excess_images(200), ElementsAre(6, 12, 50, 200));
}

TEST_F(Excess, IsAboveTheOwnOptimumAtThePoseOfTheRule) {
  std::vector<records::StepNumbers> steps(4);
  const double measured[] = {0.3, 0.1, 0.2, 0.4}, glued[] = {0.65, 0.13, 0.05, 0.04},
               recommended[] = {0.65, 0.65, 0.13, 0.05};
  for (std::size_t i = 0; i < steps.size(); ++i) {
    steps[i].measured = measured[i];
    steps[i].glued_mse = glued[i] * glued[i];
    steps[i].recommended_mse = recommended[i] * recommended[i];
  }
  const double start = std::sqrt(0.42);  // 0.65 above 0.05
  EXPECT_THAT(excess_errors(steps, kToyOptimum * kToyOptimum, Rule::own, kRmse),
              ElementsAre(DoubleEq(start), DoubleEq(start), DoubleEq(0.12), 0));
  EXPECT_EQ(excess_errors(steps, kToyOptimum * kToyOptimum, Rule::own, kRmse),
            track_values(steps, kToyOptimum * kToyOptimum, Track::excess, kRmse));
  EXPECT_THAT(excess_errors(steps, kToyOptimum * kToyOptimum, Rule::best, kRmse),
              ElementsAre(DoubleEq(start), DoubleEq(0.12), DoubleEq(0.12), DoubleEq(0.12)));
  EXPECT_THAT(excess_errors(steps, kToyOptimum * kToyOptimum, Rule::current, kRmse),
              ElementsAre(DoubleEq(start), DoubleEq(0.12), 0, 0))
      << "below the optimum, within the error of the estimate, counts as 0";
  for (const Rule rule : kRules)
    EXPECT_THAT(excess_errors(steps, kNoOptimum, rule, kRmse), ElementsAre(IsNan(), IsNan(), IsNan(), IsNan()));
}

TEST_F(Excess, OfASeriesIsThatOfItsStepsAndRules) {
  // Recommended 0.13 from step 6 on, commanded 0.25 except 0.37 at step 6 and at the end, lowest measured at step 7.
  std::vector<double> recommended(9, 0.65), commanded(9, 0.25), measured(9, 0.5);
  for (std::size_t step = 6; step < 9; ++step) recommended[step] = 0.13;
  commanded[6] = commanded[8] = 0.37;
  commanded[7] = 0.05;
  measured[7] = 0.1;
  const Study study = make_study(table({trial(0, recommended, commanded, measured, 8)}), {});
  const std::vector<ExcessAfter>& excess = study.series.at(0).excess;
  ASSERT_EQ(excess.size(), 2U);
  EXPECT_EQ(excess[0].images, 6U);
  EXPECT_EQ(excess[1].images, 8U);
  EXPECT_DOUBLE_EQ(excess[0].rules[Rule::own].values.median, 0.12) << "step 6 is image 6; step 0 does not count";
  EXPECT_DOUBLE_EQ(excess[0].rules[Rule::best].values.median, above(0.25)) << "the first of equal ones";
  EXPECT_DOUBLE_EQ(excess[0].rules[Rule::current].values.median, above(0.37));
  EXPECT_DOUBLE_EQ(excess[1].rules[Rule::own].values.median, 0.12);
  EXPECT_EQ(excess[1].rules[Rule::best].values.median, 0);
  EXPECT_DOUBLE_EQ(excess[1].rules[Rule::current].values.median, above(0.37));
  EXPECT_FALSE(excess[1].rules[Rule::own].interval.exists()) << "one instance";
}

TEST_F(Excess, CarriesEarlyEndsForwardAndSkipsFailures) {
  std::vector<records::TrialRecord> trials = {constant(0, 0.13, 2, 8), constant(1, 0.25, 8, 8), constant(2, 0.37, 8, 8),
                                              constant(3, 0.9, 8, 8)};
  trials[3].end = "timeout";
  const Study study = make_study(table(trials), {});
  const ExcessScore& score = study.series.at(0).excess.at(0).rules[Rule::own];
  EXPECT_EQ(score.values.n, 3U);
  EXPECT_DOUBLE_EQ(score.values.median, above(0.25));
  EXPECT_DOUBLE_EQ(score.values.q25, (0.12 + above(0.25)) / 2);
  const Resampling draws(4, kResamples, 0);
  const Band band =
      bands(draws, {{above(0.13), above(0.25), above(0.37), kNoOptimum}}, OrderStatistic::median()).front();
  EXPECT_EQ(score.interval.low, band.interval.low) << "the draws are those of the group";
  EXPECT_EQ(score.interval.high, band.interval.high);
}

TEST_F(Excess, IsEmptyWithoutOwnOptima) {
  records::TrialRecord blind = constant(0, 0.1, 2, 2);
  blind.own_optimum = {};
  EXPECT_TRUE(make_study(table({blind}), {}).series.at(0).excess.empty());
  records::TrialRecord failed = constant(0, 0.1, 2, 2);
  failed.end = "crashed";
  EXPECT_TRUE(make_study(table({failed}), {}).series.at(0).excess.empty());
}

// A folder of many trials has intervals for the rule of the report only; quartiles remain.
TEST_F(Excess, ManyTrialsHaveIntervalsOfOneRule) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i <= kManyTrials; ++i)
    trials.push_back(constant(i, 0.1 + 1e-5 * static_cast<double>(i % 997), 1, 1));
  StudyOptions options;
  options.rule = Rule::best;
  const Study study = make_study(table(trials), options);
  const ExcessAfter& after = study.series.at(0).excess.at(0);
  EXPECT_TRUE(after.rules[Rule::best].interval.exists());
  EXPECT_FALSE(after.rules[Rule::own].interval.exists());
  EXPECT_EQ(after.rules[Rule::own].values.median, after.rules[Rule::best].values.median);
}

}  // namespace
}  // namespace relign::statistics
