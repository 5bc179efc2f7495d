#include "statistics/study_aggregate.h"

#include <gmock/gmock.h>

#include <cmath>

#include "statistics/made_table.h"

namespace relign::statistics {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::IsEmpty;

class StudyAggregate : public MadeTable {
 protected:
  // Excess errors after each step, for a start at 0.1 and an own optimum of 0.02.
  static records::TrialRecord trial(const std::string& algorithm, const std::string& level, std::uint64_t instance,
                                    const std::vector<double>& excess, const std::string& training = "") {
    constexpr double kOwn = 0.02 * 0.02;
    records::TrialRecord record;
    record.algorithm = record.algorithm_id = algorithm;
    if (!training.empty()) {
      record.method = algorithm;
      record.training = training;
      record.algorithm += " (" + training + ")";
    }
    record.trial = algorithm + training + level + std::to_string(instance);
    record.scene = "toy";
    record.noise_level = level;
    record.protocol = "paper";
    record.instance = instance;
    record.end = "finished";
    record.budget = 4;
    record.own_optimum.mse = kOwn;
    for (std::size_t number = 0; number < excess.size(); ++number) {
      records::StepRecord step;
      step.step = static_cast<unsigned>(number);
      step.commanded_mse = number == 0 ? kOwn + 0.01 : 1;
      step.recommended_mse = kOwn + excess[number] * excess[number];
      step.recommendation = "own";
      record.steps.push_back(step);
    }
    return record;
  }

  AggregateStudy study_of(const std::vector<records::TrialRecord>& trials) {
    StudyOptions options;
    options.resamples = 200;
    const Study study = make_study(table(trials), options);
    EXPECT_EQ(study.aggregates.size(), 1u);
    return study.aggregates.front();
  }
};

TEST_F(StudyAggregate, RanksMethodsByTheInterquartileMeanOverAllStrata) {
  std::vector<records::TrialRecord> trials;
  for (const std::string level : {"calm", "rough"})
    for (std::uint64_t i = 0; i < 4; ++i) {
      trials.push_back(trial("slow", level, i, {0.1, 0.1, 0.01}));
      trials.push_back(trial("fast", level, i, {0.1, 0.001}));
    }
  const AggregateStudy found = study_of(trials);
  EXPECT_EQ(found.protocol, "paper");
  EXPECT_THAT(found.strata, ElementsAre(0, 1));
  ASSERT_EQ(found.methods.size(), 2u);
  EXPECT_EQ(found.methods[0].name, "fast");
  EXPECT_THAT(found.methods[0].trainings, IsEmpty());
  EXPECT_EQ(found.methods[0].strata, 2u);
  EXPECT_EQ(found.methods[0].steps, 4u);
  EXPECT_EQ(found.methods[0].bands.iqm.n, 8u);
  EXPECT_NEAR(found.methods[0].bands.iqm.estimate, 1.0 / 3, 1e-12);
  EXPECT_NEAR(found.methods[0].bands.area.estimate, 1.0 / 3, 1e-12);
  EXPECT_NEAR(found.methods[1].bands.iqm.estimate, 2.0 / 3, 1e-12);
  EXPECT_NEAR(found.methods[1].bands.area.estimate, (1 + 3 * 2.0 / 3) / 4, 1e-12);
  EXPECT_THAT(found.methods[1].by_step,
              ElementsAre(1, 1, DoubleNear(2.0 / 3, 1e-12), DoubleNear(2.0 / 3, 1e-12), DoubleNear(2.0 / 3, 1e-12)));
  ASSERT_EQ(found.pairs.size(), 1u);
  EXPECT_EQ(found.pairs[0].share.estimate, 1) << "fast is better on every instance";
}

TEST_F(StudyAggregate, CountsFailedTrialsAsErrorOne) {
  records::TrialRecord failed = trial("a", "calm", 3, {0.1, 0.0001});
  failed.end = "timeout";
  const AggregateStudy found = study_of({trial("a", "calm", 0, {0.1, 0.0001}), trial("a", "calm", 1, {0.1, 0.0001}),
                                         trial("a", "calm", 2, {0.1, 0.0001}), failed});
  const AggregateMethod& a = found.methods.front();
  EXPECT_EQ(a.failed, 1u);
  EXPECT_EQ(a.bands.gap.n, 4u);
  EXPECT_DOUBLE_EQ(a.bands.gap.estimate, 0.25);
  EXPECT_DOUBLE_EQ(a.bands.area.estimate, 0.25);
  EXPECT_THAT(a.by_step, ElementsAre(1, 0.25, 0.25, 0.25, 0.25));
}

TEST_F(StudyAggregate, RanksMethodsWithoutAllStrataLast) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 3; ++i) {
    trials.push_back(trial("half", "calm", i, {0.1, 0.0001}));
    trials.push_back(trial("whole", "calm", i, {0.1, 0.01}));
    trials.push_back(trial("whole", "rough", i, {0.1, 0.01}));
  }
  const AggregateStudy found = study_of(trials);
  ASSERT_EQ(found.methods.size(), 2u);
  EXPECT_EQ(found.methods[0].name, "whole");
  EXPECT_EQ(found.methods[1].name, "half");
  EXPECT_EQ(found.methods[1].strata, 1u);
  EXPECT_TRUE(std::isnan(found.methods[1].bands.iqm.estimate));
  EXPECT_THAT(found.pairs, IsEmpty());
}

TEST_F(StudyAggregate, PoolsTrainingsAndListsEach) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 6; ++i) {
    trials.push_back(trial("net", "calm", i, {0.1, 0.01}, "one"));
    trials.push_back(trial("net", "calm", i, {0.1, 0.001}, "two"));
    trials.push_back(trial("search", "calm", i, {0.1, 0.01}));
  }
  const AggregateStudy found = study_of(trials);
  ASSERT_EQ(found.methods.size(), 2u);
  const AggregateMethod& net = found.methods[0];
  EXPECT_EQ(net.name, "net");
  EXPECT_THAT(net.trainings, ElementsAre("one", "two"));
  EXPECT_EQ(net.bands.iqm.n, 12u);
  EXPECT_NEAR(net.bands.gap.estimate, 0.5, 1e-12);
  EXPECT_NEAR(net.bands.gap.interval.low, 1.0 / 3, 1e-12) << "one training may be drawn twice";
  EXPECT_NEAR(net.bands.gap.interval.high, 2.0 / 3, 1e-12);
  ASSERT_EQ(net.members.size(), 2u);
  EXPECT_EQ(net.members[0].name, "one");
  EXPECT_NEAR(net.members[0].bands.iqm.estimate, 2.0 / 3, 1e-12);
  EXPECT_NEAR(net.members[1].bands.iqm.estimate, 1.0 / 3, 1e-12);
  EXPECT_DOUBLE_EQ(found.pairs.at(0).share.estimate, 0.75)
      << "training one ties with the search, training two is better";
}

TEST_F(StudyAggregate, NeedsGroundTruth) {
  records::TrialRecord station = trial("a", "calm", 0, {0.1, 0.01});
  station.own_optimum = {};
  EXPECT_THAT(make_study(table({station}), {}).aggregates, IsEmpty());
}

}  // namespace
}  // namespace relign::statistics
