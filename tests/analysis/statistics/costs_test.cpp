#include "statistics/costs.h"

#include <gmock/gmock.h>

#include <cmath>

#include "statistics/made_table.h"
#include "statistics/study.h"

namespace relign::statistics {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;

Prices prices() {
  Prices made;
  made.station_per_hour = 36;
  made.module = 4;
  made.currency = "EUR";
  return made;
}

TEST(Costs, OfALineWithoutRework) {
  // 36 an hour are 0.01 a second: 10 s cost 0.1, and one module of five is scrapped.
  const LineCost cost = line_cost(prices(), 0.8, 10);
  EXPECT_DOUBLE_EQ(cost.per_good_module(), (0.1 + 0.2 * 4) / 0.8);
  EXPECT_DOUBLE_EQ(cost.good_per_hour(), 360 * 0.8);
  EXPECT_DOUBLE_EQ(cost.scrapped, 1 - 0.8);
  EXPECT_TRUE(std::isinf(line_cost(prices(), 0, 10).per_good_module()));
}

TEST(Costs, OfALineWithReworkAreThoseOfItsCounts) {
  Prices with = prices();
  with.rework = 1;
  // Of 100 modules 80 are good; 20 are aligned again, and 16 of these are good: 120 alignments for 96 good modules.
  const LineCost cost = line_cost(with, 0.8, 10);
  EXPECT_THAT(cost.per_good_module(), DoubleNear((120 * 0.1 + 20 * 1 + 4 * 4) / 96.0, 1e-12));
  EXPECT_THAT(cost.good_per_hour(), DoubleNear(96 / (120 * 10 / 3600.0), 1e-9));
  EXPECT_THAT(cost.scrapped, DoubleNear(0.04, 1e-12));
}

class CostStudyTest : public MadeTable {
 protected:
  // Ten seconds a step. Met from step `arrives` on, and at step 3 only if it `stays`.
  static records::TrialRecord trial(const std::string& algorithm, std::uint64_t instance, unsigned arrives,
                                    bool stays = false) {
    records::TrialRecord record;
    record.trial = algorithm + std::to_string(instance);
    record.scene = "toy";
    record.noise_level = "calm";
    record.protocol = "paper";
    record.algorithm = record.algorithm_id = algorithm;
    record.instance = instance;
    record.end = "budget_spent";
    record.budget = 3;
    for (unsigned number = 0; number <= 3; ++number) {
      records::StepRecord step;
      step.step = number;
      step.measured = 0.1;
      step.commanded_mse = step.recommended_mse = number >= arrives && (stays || number < 3) ? 1e-4 : 1e-2;
      step.machine_seconds = 10 * number;
      step.recommended_seconds = 10 * number + 1;
      step.recommendation = "own";
      record.steps.push_back(step);
    }
    return record;
  }
  static StudyOptions options() {
    StudyOptions made;
    made.spec.score = 0.05;
    made.prices = prices();
    made.prices.baseline = "b";
    made.cycle = {5, false};
    return made;
  }
};

TEST_F(CostStudyTest, CountsFailedTrialsAndEndsEveryModuleAtTheSameImage) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 8; ++i) {
    trials.push_back(trial("a", i, 1));
    trials.push_back(trial("b", i, 2));
  }
  trials.push_back(trial("a", 8, 1));
  trials.back().end = "timeout";
  trials.push_back(trial("b", 8, 2));
  const Study study = make_study(table(trials), options());
  const std::vector<CostStudy>& a = study.series.at(0).costs;
  ASSERT_EQ(a.size(), 2U);
  EXPECT_THAT(a[0].steps, ElementsAre(3, 3));
  EXPECT_EQ(a[0].met.estimate, 0) << "no module is in specification at the end";
  EXPECT_TRUE(std::isinf(a[0].per_good_module.estimate));
  EXPECT_THAT(a[1].steps, ElementsAre(1, 1)) << "one step is the cheapest on each half";
  EXPECT_EQ(a[1].met.n, 9U);
  EXPECT_DOUBLE_EQ(a[1].met.estimate, 8 / 9.0) << "the failed trial's module misses";
  EXPECT_DOUBLE_EQ(a[1].seconds.estimate, 5 + 11) << "the cycle, one step, and the move to the recommendation";
  EXPECT_THAT(a[1].per_good_module.estimate, DoubleNear((0.16 + 4 / 9.0) / (8 / 9.0), 1e-9));
  EXPECT_LT(a[1].per_good_module.interval.low, a[1].per_good_module.estimate);
  EXPECT_GT(a[1].per_good_module.interval.high, a[1].per_good_module.estimate);
  const std::vector<CostStudy>& b = study.series.at(1).costs;
  EXPECT_THAT(b[1].steps, ElementsAre(2, 2));
  EXPECT_DOUBLE_EQ(b[1].per_good_module.estimate, 0.26);
  // Nine of nine met: the share may be as low as Wilson's limit, the time is the same for all.
  const double wilson = success_rate(9, 9).interval.low;
  EXPECT_DOUBLE_EQ(b[1].per_good_module.interval.low, 0.26);
  EXPECT_DOUBLE_EQ(b[1].per_good_module.interval.high, (0.26 + (1 - wilson) * 4) / wilson);
  EXPECT_EQ(b[1].saves.n, 0U) << "nothing against itself";
  EXPECT_THAT(a[1].saves.estimate, DoubleNear(0.26 - a[1].per_good_module.estimate, 1e-12));
}

TEST_F(CostStudyTest, ChoosesTheNumberOfImagesOnTheOtherHalf) {
  std::vector<records::TrialRecord> trials;  // every second instance arrives one step later
  for (std::uint64_t i = 0; i < 10; ++i) trials.push_back(trial("a", i, i % 2 == 0 ? 1 : 2));
  const Study study = make_study(table(trials), options());
  const CostStudy& cost = study.series.at(0).costs.at(1);
  // The even instances are cheapest with one step, the odd ones with two; each half gets the other's number.
  EXPECT_THAT(cost.steps, ElementsAre(2, 1));
  EXPECT_DOUBLE_EQ(cost.met.estimate, 0.5);
  EXPECT_DOUBLE_EQ(cost.seconds.estimate, (26 + 16) / 2.0);
  // Student's interval of five times of 26 and five of 16: t(9) = 2.262157.
  EXPECT_THAT(cost.seconds.interval.high, DoubleNear(21 + 2.262157 * std::sqrt(10 * 25 / 9.0 / 10), 1e-5));
}

TEST_F(CostStudyTest, FallsBackToTheBudgetIfTheChosenNumberDoesNotCostLess) {
  // One step suffices on half of the instances and is too few for the others: 0.16 and 0.26 by themselves, but four
  // of eight modules miss with each other's numbers. Three steps bring all into specification, for 0.36.
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 8; ++i) {
    trials.push_back(trial("a", i, i % 2 == 0 ? 1 : 2, true));
    trials.push_back(trial("b", i, 1, true));
  }
  const Study study = make_study(table(trials), options());
  const std::vector<CostStudy>& a = study.series.at(0).costs;
  const std::vector<CostStudy>& b = study.series.at(1).costs;
  EXPECT_THAT(a.at(1).steps, ElementsAre(3, 3));
  EXPECT_DOUBLE_EQ(a.at(1).met.estimate, 1);
  EXPECT_DOUBLE_EQ(a.at(1).seconds.estimate, a.at(0).seconds.estimate);
  EXPECT_DOUBLE_EQ(a.at(1).per_good_module.estimate, 0.36);
  EXPECT_THAT(b.at(1).steps, ElementsAre(1, 1)) << "which costs less, and stays";
  EXPECT_DOUBLE_EQ(a.at(0).saves.estimate, 0) << "budget against budget";
  EXPECT_DOUBLE_EQ(a.at(1).saves.estimate, 0.16 - 0.36) << "least cost against least cost";
}

TEST_F(CostStudyTest, NeedsPricesTheOwnRuleAndASpecification) {
  const TrialTable made = table({trial("a", 0, 1), trial("a", 1, 1)});
  const auto costs = [&](StudyOptions of) { return make_study(made, std::move(of)).series.at(0).costs.size(); };
  EXPECT_EQ(costs(options()), 2U);
  StudyOptions changed = options();
  changed.prices = Prices();
  EXPECT_EQ(costs(changed), 0U);
  changed = options();
  changed.rule = Rule::best;
  EXPECT_EQ(costs(changed), 0U);
  changed = options();
  changed.spec = records::Specification();
  EXPECT_EQ(costs(changed), 0U);
}

}  // namespace
}  // namespace relign::statistics
