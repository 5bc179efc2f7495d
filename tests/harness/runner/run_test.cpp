#include "runner/run.h"

#include <fstream>

#include "base/machine.h"
#include "toy_suites.h"

namespace relign::runner {
namespace {

using testing::HasSubstr;
using RunTest = ToyTest;

TEST_F(RunTest, RunsEveryTrialOfThePlan) {
  const PreparedPlan plan = prepared(suite_text(R"("toy-walker")"));
  const RunSummary summary = run(plan, options("a"));
  EXPECT_EQ(summary.trials, 12U);
  EXPECT_EQ(summary.finished, 12U);
  EXPECT_EQ(summary.reused, 0U);
  EXPECT_EQ(summary.failed, 0U);
  EXPECT_FALSE(summary.stopped);
  const auto trials = records::read_trials(folder_ / "a");
  ASSERT_EQ(trials.size(), 12U);
  for (std::size_t index = 0; index < trials.size(); ++index) {
    const records::TrialRecord& record = trials[index];
    EXPECT_EQ(record.trial, plan.plan.trials[index].id);
    EXPECT_EQ(record.instance, plan.plan.trials[index].instance);
    EXPECT_EQ(record.noise_level, index < 6 ? "toy-level" : "toy-wild");
    EXPECT_EQ(record.end, "budget_spent");
    EXPECT_EQ(record.steps.size(), 6U);
    EXPECT_EQ(record.budget, 5U);
    EXPECT_THAT(record.warnings, testing::IsEmpty());
  }
  // The same seed at both levels: it depends on the instance number.
  EXPECT_EQ(trials[0].instance_seed, trials[6].instance_seed);
  EXPECT_EQ(trials[0].steps[0].true_pose, trials[6].steps[0].true_pose);
  EXPECT_THAT(messages_, testing::IsEmpty());
}

TEST_F(RunTest, ResultsDoNotDependOnTheNumberOfWorkers) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  for (const unsigned workers : {1U, 2U, 3U}) run(plan, options(std::to_string(workers), workers));
  const auto one = contents("1");
  EXPECT_GT(one.size(), 10U);
  EXPECT_EQ(one, contents("2"));
  EXPECT_EQ(one, contents("3"));
}

TEST_F(RunTest, FailingAlgorithmFailsOnlyItsTrials) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  const RunSummary summary = run(plan, options("a", 2));
  EXPECT_EQ(summary.trials, 36U);
  EXPECT_EQ(summary.finished, 36U);
  std::size_t failed = 0;
  std::size_t ended_early = 0;
  for (const records::TrialRecord& record : records::read_trials(folder_ / "a")) {
    if (record.end == "failed") {
      ++failed;
      EXPECT_EQ(record.algorithm, "toy-stumbler");
      EXPECT_THAT(record.message, HasSubstr("stumbled"));
      EXPECT_EQ(record.steps.size(), 3U);  // completed steps are kept
    }
    if (record.end == "finished") ++ended_early;
    if (record.algorithm == "short-walker") {
      EXPECT_EQ(record.steps.size(), 4U);
    }
  }
  EXPECT_EQ(failed + ended_early, 12U);
  EXPECT_GT(failed, 0U);
  EXPECT_EQ(summary.failed, failed);
  ASSERT_EQ(summary.failures.size(), failed);
  EXPECT_THAT(summary.failures[0], testing::AllOf(testing::StartsWith("trial "),
                                                  HasSubstr(" toy-stumbler on toy-scene "), HasSubstr("stumbled")));
}

TEST_F(RunTest, FailingSceneFailsOnlyItsTrials) {
  const PreparedPlan plan = prepared(
      R"({"scenes": [{"use": "toy-scene", "name": "frail", "parameters": {"broken_above": 0.7}}],
          "noise_levels": ["toy-level"], "algorithms": ["toy-walker"], "instances": 20, "steps": 5})");
  const RunSummary summary = run(plan, options("a", 2));
  EXPECT_EQ(summary.finished, 20U);
  EXPECT_GT(summary.failed, 0U);
  EXPECT_LT(summary.failed, 20U);
  for (const records::TrialRecord& record : records::read_trials(folder_ / "a"))
    if (record.end == "failed") {
      EXPECT_THAT(record.message, HasSubstr("the camera fell off"));
    }
}

TEST_F(RunTest, RecordsSideEffectsAsWarnings) {
  const PreparedPlan plan = prepared(suite_text(R"("toy-meddler")"));
  const fs::path before = fs::current_path();
  run(plan, options("a"));
  EXPECT_EQ(fs::current_path(), before);
  const auto trials = records::read_trials(folder_ / "a");
  ASSERT_EQ(trials.size(), 12U);
  ASSERT_EQ(trials[3].warnings.size(), 1U);
  EXPECT_THAT(trials[3].warnings[0], testing::StartsWith("toy-meddler: "));
}

TEST_F(RunTest, OnlySelectsTrials) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  RunOptions some = options("a");
  some.only = {{"algorithm", "toy_walker"}, {"noise-level", "toy-wild"}, {"instance", "2"}, {"instance", "4"}};
  EXPECT_EQ(run(plan, some).finished, 2U);
  const auto trials = records::read_trials(folder_ / "a");
  ASSERT_EQ(trials.size(), 2U);
  EXPECT_EQ(trials[0].algorithm + trials[0].noise_level + std::to_string(trials[0].instance), "toy-walkertoy-wild2");
  // Running the rest gives the folder of one run.
  const RunSummary rest = run(plan, options("a"));
  EXPECT_EQ(rest.reused, 2U);
  run(plan, options("b"));
  EXPECT_EQ(contents("a"), contents("b"));
}

TEST_F(RunTest, RejectsOnlyWithoutMatches) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  RunOptions some = options("a");
  some.only = {{"algoritm", "x"}};
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { run(plan, some); }), HasSubstr("did you mean 'algorithm'?"));
  some.only = {{"algorithm", "toy-waker"}};
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { run(plan, some); }), HasSubstr("did you mean 'toy-walker'?"));
  some.only = {{"instance", "6"}};
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { run(plan, some); }), HasSubstr("the plan has 0 to 5"));
  EXPECT_FALSE(fs::exists(folder_ / "a"));
}

TEST_F(RunTest, ManifestRecordsSuiteAndPlugins) {
  const std::string text = suite_text(kWalkers, R"(, "machine_time": {"settle_ms": 7})");
  const PreparedPlan plan = prepared(text);
  RunOptions with_command = options("a");
  with_command.command = "relign-bench run toy.json";
  run(plan, with_command);
  const Json manifest = records::read_manifest_json(folder_ / "a");
  EXPECT_EQ(manifest["format"], 1);
  EXPECT_EQ(manifest["suite"], text);
  EXPECT_EQ(manifest["suite_name"], "toy");
  EXPECT_EQ(manifest["command"], "relign-bench run toy.json");
  EXPECT_EQ(manifest["trials"], 36);
  ASSERT_EQ(manifest["order"].size(), 36U);
  EXPECT_EQ(manifest["order"][35], plan.plan.trials[35].id);
  EXPECT_EQ(manifest["instance_set"], plan.plan.instance_set);
  EXPECT_EQ(manifest["machine_time"], Json({{"settle_ms", 7}}));
  EXPECT_EQ(manifest["algorithms"][2]["name"], "short-walker");
  EXPECT_EQ(manifest["algorithms"][2]["steps"], 3);
  EXPECT_EQ(manifest["algorithms"][0]["observes"], Json({"merit", "box"}));
  EXPECT_EQ(manifest["algorithms"][0]["plugin_hash"].get<std::string>().size(), 64U);
  EXPECT_EQ(manifest["program"]["hash"].get<std::string>().size(), 64U);
  EXPECT_FALSE(manifest["program"]["compiler"].get<std::string>().empty());
  EXPECT_FALSE(manifest["machine"]["cpu"].get<std::string>().empty());
  EXPECT_EQ(manifest["machine"]["instruction_sets"], instruction_sets());
  EXPECT_TRUE(fs::exists(folder_ / "a" / manifest["scenes"][0]["folder"].get<std::string>() / "description.json"));
}

TEST_F(RunTest, ProgressCountsEveryTrial) {
  RunOptions watched = options("a", 2);
  std::vector<Progress> seen;
  watched.on_progress = [&seen](const Progress& progress) { seen.push_back(progress); };
  run(prepared(suite_text(kWalkers)), watched);
  ASSERT_GT(seen.size(), 36U);
  EXPECT_EQ(seen.front().done, 0U);
  EXPECT_EQ(seen.front().doing, "trials");
  EXPECT_EQ(seen.back().doing, "pictures");
  EXPECT_EQ(seen.back().done, 36U);
  EXPECT_EQ(seen.back().total, 36U);
  for (std::size_t index = 1; index < seen.size(); ++index) EXPECT_GE(seen[index].done, seen[index - 1].done);
}

TEST_F(RunTest, RejectsUnwritableFoldersBeforeAnyTrial) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  RunOptions bad = options("a");
  bad.results = "/proc/results";
  EXPECT_THAT(error_text(ErrorKind::io, [&] { run(plan, bad); }), HasSubstr("/proc/results"));
  write_file_atomically(folder_ / "file", "");
  bad.results = folder_ / "file";
  error_text(ErrorKind::io, [&] { run(plan, bad); });
  write_file_atomically(folder_ / "other" / "letter.txt", "dear");
  bad.results = folder_ / "other";
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { run(plan, bad); }), HasSubstr("letter.txt"));
}

TEST_F(RunTest, ReportsLevelThatDoesNotFitTheScene) {
  const std::string text =
      R"({"scenes": ["toy-scene"], "algorithms": ["toy-walker"],
          "noise_levels": [{"use": "toy-level", "name": "odd", "parameters": {"element": "L9"}}]})";
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { prepared(text); }),
              testing::AllOf(HasSubstr("noise level 'odd' cannot be used with scene 'toy-scene'"), HasSubstr("L9")));
}

TEST_F(RunTest, RejectsUnloadableLibraryBeforeAnyTrial) {
  fs::create_directories(folder_ / "torn");
  const fs::path whole = fs::path(RELIGN_RUNNER_TEST_PLUGINS) / "toy_walker";
  fs::copy_file(whole / "relign-plugin.json", folder_ / "torn" / "relign-plugin.json");
  write_file_atomically(folder_ / "torn" / "toy_walker.so", read_file(whole / "toy_walker.so").substr(0, 2000));
  plugin_host::Catalog catalog;
  for (const char* plugin : {"toy_scene", "toy_level"}) catalog.add(fs::path(RELIGN_RUNNER_TEST_PLUGINS) / plugin);
  catalog.add(folder_ / "torn");
  const auto suite = suites::read_suite(JsonSource::from_text(suite_text("\"toy-walker\""), "toy.json"), ".", catalog);
  EXPECT_THAT(error_text(ErrorKind::plugin_rejected, [&] { prepare(suite, {}); }), HasSubstr("toy_walker.so"));
}

}  // namespace
}  // namespace relign::runner
