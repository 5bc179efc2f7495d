#include "runner/trial_runner.h"

#include <algorithm>

#include "toy_suites.h"

namespace relign::runner {
namespace {

using TrialRunnerTest = ToyTest;

// What `verify` does: any trial alone, in any order, on a runner with or without history.
TEST_F(TrialRunnerTest, AReplayEqualsTheRecord) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  run(plan, options("a", 2));
  std::map<std::string, std::string> recorded;
  for (const records::TrialRecord& record : records::read_trials(folder_ / "a"))
    recorded[record.trial] = records::to_lines(record);
  TrialRunner runner({1, {}, {}});
  for (std::size_t index : {35U, 3U, 17U, 3U, 20U, 0U}) {
    const suite::PlannedTrial& trial = plan.plan.trials[index];
    EXPECT_EQ(records::to_lines(runner.run(make_job(plan, trial)).record), recorded.at(trial.id)) << index;
    TrialRunner fresh({1, {}, {}});
    EXPECT_EQ(records::to_lines(fresh.run(make_job(plan, trial)).record), recorded.at(trial.id)) << index;
  }
}

TEST_F(TrialRunnerTest, ShowsEveryStepAndItsCapture) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  TrialRunner runner({1, {}, {}});
  std::vector<unsigned> steps;
  std::vector<float> brightest;
  const TrialOutcome outcome =
      runner.run(make_job(plan, plan.plan.trials[0]), nullptr, [&](const task::Step& step, const float* pixels) {
        steps.push_back(step.number);
        brightest.push_back(*std::max_element(pixels, pixels + 12 * 8));
      });
  EXPECT_THAT(steps, testing::ElementsAre(0, 1, 2, 3, 4, 5));
  for (const float value : brightest) EXPECT_GT(value, 0.5F);  // the spot is in the picture
  EXPECT_EQ(outcome.times.simulation_seconds.size(), 6U);
}

TEST_F(TrialRunnerTest, AStoppedTrialIsNoResult) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  TrialRunner runner({1, {}, {}});
  std::atomic<bool> stop{false};
  const TrialOutcome outcome =
      runner.run(make_job(plan, plan.plan.trials[0]), &stop, [&stop](const task::Step& step, const float*) {
        if (step.number == 2) stop = true;
      });
  EXPECT_TRUE(outcome.stopped);
  EXPECT_LT(outcome.record.steps.size(), 6U);
}

TEST_F(TrialRunnerTest, JobsCarryTheSuitesChoices) {
  const PreparedPlan plan = prepared(suite_text(R"({"use": "toy-walker", "protocol": "blind"})",
                                                R"(, "limits": "hard", "seed": 5, "machine_time": {"settle_ms": 7})"));
  const TrialJob job = make_job(plan, plan.plan.trials[7]);
  EXPECT_EQ(job.id, plan.plan.trials[7].id);
  EXPECT_EQ(job.level_name, "toy-wild");
  EXPECT_EQ(job.protocol, task::Protocol::blind);
  EXPECT_EQ(job.merit, task::Merit::rmse);
  EXPECT_EQ(job.limits, task::Limits::hard);
  EXPECT_EQ(job.machine_time.settle_ms, 7);
  EXPECT_EQ(job.machine_time.exposure_ms, 15);  // the scene's
  EXPECT_EQ(job.suite_seed, 5U);
  EXPECT_EQ(job.instance, 1U);
  EXPECT_EQ(job.budget, 5U);
}

// The user of services of tests/task; the toy walker takes over.
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
  EXPECT_NE(runner.run(make_job(plan, plan.plan.trials[1])).log, log) << "each trial has its own";
}

}  // namespace
}  // namespace relign::runner
