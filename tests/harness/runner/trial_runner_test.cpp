#include "runner/trial_runner.h"

#include <algorithm>
#include <cmath>

#include "toy_suites.h"

namespace relign::runner {
namespace {

using TrialRunnerTest = ToyTest;

// As in `verify`: single trials in any order, on a new or a used runner.
TEST_F(TrialRunnerTest, ReplayEqualsTheRecord) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  run(plan, options("a", 2));
  std::map<std::string, std::string> recorded;
  for (const records::TrialRecord& record : records::read_trials(folder_ / "a"))
    recorded[record.trial] = records::to_lines(record);
  TrialRunner runner({1, {}, {}});
  for (std::size_t index : {35U, 3U, 17U, 3U, 20U, 0U}) {
    const suites::PlannedTrial& trial = plan.plan.trials[index];
    EXPECT_EQ(records::to_lines(runner.run(make_job(plan, trial)).record), recorded.at(trial.id)) << index;
    TrialRunner fresh({1, {}, {}});
    EXPECT_EQ(records::to_lines(fresh.run(make_job(plan, trial)).record), recorded.at(trial.id)) << index;
  }
}

TEST_F(TrialRunnerTest, PassesEveryStepAndItsCapture) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  TrialRunner runner({1, {}, {}});
  std::vector<unsigned> steps;
  std::vector<float> brightest;
  const TrialOutcome outcome =
      runner.run(make_job(plan, plan.plan.trials[0]), nullptr, [&](const trials::Step& step, const float* pixels) {
        steps.push_back(step.step);
        brightest.push_back(*std::max_element(pixels, pixels + 12 * 8));
      });
  EXPECT_THAT(steps, testing::ElementsAre(0, 1, 2, 3, 4, 5));
  for (const float value : brightest) EXPECT_GT(value, 0.5F);  // the spot is in the picture
  EXPECT_EQ(outcome.times.simulation_seconds.size(), 6U);
}

TEST_F(TrialRunnerTest, StoppedTrialDoesNotCount) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  TrialRunner runner({1, {}, {}});
  std::atomic<bool> stop{false};
  const TrialOutcome outcome =
      runner.run(make_job(plan, plan.plan.trials[0]), &stop, [&stop](const trials::Step& step, const float*) {
        if (step.step == 2) stop = true;
      });
  EXPECT_TRUE(outcome.stopped);
  EXPECT_LT(outcome.record.steps.size(), 6U);
}

TEST_F(TrialRunnerTest, JobsHaveTheSettingsOfTheSuite) {
  const PreparedPlan plan = prepared(suite_text(R"({"use": "toy-walker", "protocol": "blind"})",
                                                R"(, "limits": "hard", "seed": 5, "machine_time": {"settle_ms": 7})"));
  const TrialJob job = make_job(plan, plan.plan.trials[7]);
  EXPECT_EQ(job.id, plan.plan.trials[7].id);
  EXPECT_EQ(job.level_name, "toy-wild");
  EXPECT_EQ(job.protocol, trials::Protocol::blind);
  EXPECT_EQ(job.merit, trials::Merit::rmse);
  EXPECT_EQ(job.limits, trials::Limits::hard);
  EXPECT_EQ(job.machine_time.settle_ms, 7);
  EXPECT_EQ(job.machine_time.exposure_ms, 15);  // the scene's
  EXPECT_EQ(job.seeds.instances, 5U);
  EXPECT_EQ(job.instance, 1U);
  EXPECT_EQ(job.budget, 5U);
}

TEST_F(TrialRunnerTest, MeasuresTheMtfOfTheSpecification) {
  const PreparedPlan plan = prepared(mtf_suite(R"({"mtf": {"lp_per_mm": 4, "centre": 0.5}})"));
  const PreparedPlan without = prepared(mtf_suite(R"({"rmse": 0.1})"));
  ASSERT_EQ(plan.plan.trials.size(), without.plan.trials.size());
  TrialRunner runner({1, {}, {}});
  for (const suites::PlannedTrial& trial : plan.plan.trials) {
    const records::TrialRecord record = runner.run(make_job(plan, trial)).record;
    const double shift = 0.5 - record.own_optimum.pose.at(0);
    const std::vector<double>& glued = record.steps.back().recommended_true_pose;
    const double centre = 1 / (1 + 4 * std::fabs(glued[0] + shift - 0.5));
    EXPECT_NEAR(record.scores.mtf[records::Rule::own][records::Curing::after].centre, centre, 1e-12);
    EXPECT_NEAR(record.scores.mtf[records::Rule::own][records::Curing::after].corner,
                centre / (1 + 4 * std::fabs(glued[1] - 0.5)), 1e-12);
    EXPECT_NEAR(record.own_optimum.mtf.corner, 1, 1e-12);
    EXPECT_TRUE(std::isnan(record.scores.mtf[records::Rule::own][records::Curing::before].centre))
        << "curing shifts nothing";
  }
  for (std::size_t index = 0; index < plan.plan.trials.size(); ++index) {
    EXPECT_NE(plan.plan.trials[index].id, without.plan.trials[index].id);
    const records::TrialRecord record = runner.run(make_job(without, without.plan.trials[index])).record;
    EXPECT_THAT(records::to_lines(record), testing::Not(testing::HasSubstr("mtf")));
  }
}

TEST_F(TrialRunnerTest, RejectsSceneWithoutMtf) {
  const std::string told = error_text(
      ErrorKind::bad_input, [] { prepared(mtf_suite(R"({"mtf": {"lp_per_mm": 80, "corner": 0.35}})", false)); });
  EXPECT_THAT(told,
              testing::HasSubstr("the suite's 'spec' requires the MTF at 80 lp/mm, which is unavailable for the scene "
                                 "'sharp': it does not offer it; remove 'mtf' from"));
}

// The service user of tests/harness/trials, which runs the toy walker as inner algorithm.
TEST_F(TrialRunnerTest, OffersDesignLevelAndOtherAlgorithms) {
  const PreparedPlan plan = prepared(suite_text(R"({"use": ")" RELIGN_SERVICE_USER R"(", "name": "user", "parameters": {
      "then": "toy-walker",
      "script": [["draw", 1], ["model", {}, [0.5, 0.5], 1], ["run", "then", 3]]}})"));
  std::vector<std::string> said;
  TrialRunner runner({1, {}, [&](const std::string& message) { said.push_back(message); }});
  const TrialOutcome outcome = runner.run(make_job(plan, plan.plan.trials[0]));
  EXPECT_EQ(outcome.record.message, "");
  EXPECT_THAT(outcome.record.steps, testing::SizeIs(4));
  ASSERT_THAT(said, testing::SizeIs(3));
  EXPECT_THAT(said[0], testing::StartsWith("user: draw "));
  EXPECT_THAT(said[1], testing::StartsWith("user: model [96,"));
  EXPECT_THAT(said[2], testing::AllOf(testing::StartsWith("user: run "), testing::HasSubstr("\"steps\":3")));
  std::string log;
  for (const std::string& message : said) log += "warning: " + message.substr(6) + "\n";
  EXPECT_EQ(outcome.log, log);
  EXPECT_NE(runner.run(make_job(plan, plan.plan.trials[1])).log, log) << "each trial has its own log";
}

}  // namespace
}  // namespace relign::runner
