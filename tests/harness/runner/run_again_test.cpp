// Runs into a folder with existing results: stopped, changed, renamed.
#include <thread>

#include "runner/run.h"
#include "toy_suites.h"

namespace relign::runner {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;
using RunAgainTest = ToyTest;

TEST_F(RunAgainTest, SecondRunReusesEverything) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  const RunSummary first = run(plan, options("a"));
  const auto before = contents("a");
  const RunSummary second = run(plan, options("a"));
  EXPECT_EQ(second.reused, 36U);
  EXPECT_EQ(second.finished, 36U);
  EXPECT_EQ(second.failed, first.failed);
  EXPECT_EQ(second.failures, first.failures);
  EXPECT_EQ(contents("a"), before);
  EXPECT_THAT(messages_, testing::IsEmpty());
}

// Stopped after some trials, while others are running, and resumed until all are finished.
TEST_F(RunAgainTest, ResumedRunEqualsUninterruptedRun) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  run(plan, options("whole"));
  const auto whole = contents("whole");
  std::size_t rounds = 0;
  for (bool stopped = true; stopped; ++rounds) {
    ASSERT_LT(rounds, 20U);
    std::atomic<bool> stop{false};
    RunOptions interrupted = options("parts", 2);
    interrupted.stop = &stop;
    std::size_t fresh = 0;
    interrupted.on_progress = [&](const Progress& progress) {
      if (progress.done > progress.reused && ++fresh == 5) stop = true;
    };
    const RunSummary summary = run(plan, interrupted);
    stopped = summary.stopped;
    if (stopped) {
      EXPECT_LE(summary.finished, summary.reused + 7);
    }
  }
  EXPECT_GT(rounds, 3U);
  EXPECT_EQ(contents("parts"), whole);
}

TEST_F(RunAgainTest, StopBeforeTheFirstTrialRunsNone) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  const std::atomic<bool> stop{true};
  RunOptions stopped = options("a");
  stopped.stop = &stop;
  const RunSummary summary = run(plan, stopped);
  EXPECT_TRUE(summary.stopped);
  EXPECT_EQ(summary.finished, 0U);
}

TEST_F(RunAgainTest, HalfWrittenTrialsRunAgain) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  run(plan, options("a"));
  const auto whole = contents("a");
  const std::string trials = read_file(folder_ / "a/trials/0000.jsonl");
  write_file_atomically(folder_ / "a/trials/0000.jsonl", trials.substr(0, trials.size() / 2));
  const RunSummary summary = run(plan, options("a"));
  EXPECT_LT(summary.reused, 36U);
  EXPECT_EQ(summary.finished, 36U);
  EXPECT_EQ(contents("a"), whole);
  ASSERT_EQ(messages_.size(), 1U);
  EXPECT_THAT(messages_[0], HasSubstr("half-written"));
}

// SIGKILL may leave them, at the moment when a file replaces another one.
TEST_F(RunAgainTest, RemovesTemporaryFilesOfKilledPrograms) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  run(plan, options("a"));
  const auto whole = contents("a");
  const std::string trial = plan.plan.trials.front().id;
  for (const std::string& file : {"logs/" + trial + ".txt", "pictures/" + trial + "/step-008.png",
                                  std::string("manifest.json"), std::string("trials/0000.jsonl")})
    write_file_atomically(folder_ / "a" / (file + ".relign-tmp-Q3x9aB"), "half");
  EXPECT_EQ(run(plan, options("a")).reused, 36U);
  EXPECT_EQ(contents("a"), whole);
}

TEST_F(RunAgainTest, DamagedTrialsRunAgainOnlyWhenAsked) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  run(plan, options("a"));
  const auto whole = contents("a");
  std::string trials = read_file(folder_ / "a/trials/0000.jsonl"), times = read_file(folder_ / "a/times/0000.jsonl");
  trials[trials.find("\"measured\":", trials.size() / 2) + 14] ^= 1;
  write_file_atomically(folder_ / "a/trials/0000.jsonl", trials);
  times[times.find("simulation_seconds") + 22] ^= 1;
  write_file_atomically(folder_ / "a/times/0000.jsonl", times);
  const auto damaged = contents("a");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { run(plan, options("a")); }),
              AllOf(HasSubstr("a/trials/0000.jsonl:"), HasSubstr("a/times/0000.jsonl:1"), HasSubstr("--drop-damaged")));
  EXPECT_EQ(contents("a"), damaged);
  RunOptions drop = options("a");
  drop.drop_damaged = true;
  const RunSummary summary = run(plan, drop);
  EXPECT_EQ(summary.reused, 34U);
  EXPECT_EQ(summary.finished, 36U);
  EXPECT_EQ(contents("a"), whole);
  EXPECT_THAT(messages_, Contains(HasSubstr("dropped: ")));
}

TEST_F(RunAgainTest, RunsTrialsOfAChangedPluginAgain) {
  run(prepared(suite_text(kWalkers)), options("a"));
  const PreparedPlan changed = prepared(suite_text(kWalkers), "toy_walker_changed");
  const RunSummary summary = run(changed, options("a"));
  EXPECT_THAT(messages_, ElementsAre("toy-walker changed: 24 trials run again"));
  EXPECT_EQ(summary.reused, 12U);  // the stumbler's
  EXPECT_EQ(summary.finished, 36U);
  run(changed, options("fresh"));
  EXPECT_EQ(contents("a"), contents("fresh"));
  // The results did change, with another stride.
  run(prepared(suite_text(kWalkers)), options("before"));
  EXPECT_NE(read_file(folder_ / "before/trials/0000.jsonl"), read_file(folder_ / "a/trials/0000.jsonl"));
}

TEST_F(RunAgainTest, RunsTrialsOfUnknownPluginsAgain) {
  run(prepared(suite_text(kWalkers)), options("a"));
  const auto whole = contents("a");
  fs::remove_all(folder_ / "a/times");
  const RunSummary summary = run(prepared(suite_text(kWalkers)), options("a"));
  EXPECT_THAT(messages_, ElementsAre("times/ does not tell which plugins made 36 finished trials; they run again"));
  EXPECT_EQ(summary.reused, 0U);
  EXPECT_EQ(contents("a"), whole);
}

TEST_F(RunAgainTest, RunsTrialsOfARenamedLevelAgain) {
  const auto text = [](const char* name) {
    return R"({"scenes": ["toy-scene"], "algorithms": ["toy-walker"], "instances": 3, "steps": 2, "noise_levels": [
               {"use": "toy-level", "name": ")" +
           std::string(name) + R"(", "parameters": {"width": 0.3}}]})";
  };
  run(prepared(text("wide")), options("a"));
  run(prepared(text("broad")), options("a"));
  ASSERT_EQ(messages_.size(), 1U);
  EXPECT_THAT(messages_[0], HasSubstr("were renamed in the suite: 3 trials run again"));
  for (const records::TrialRecord& record : records::read_trials(folder_ / "a")) EXPECT_EQ(record.noise_level, "broad");
}

TEST_F(RunAgainTest, KeepsButHidesTrialsOfAnEarlierSuite) {
  run(prepared(suite_text("\"toy-walker\"")), options("a"));
  const PreparedPlan longer = prepared(suite_text("\"toy-walker\"", R"(, "seed": 2)"));
  const RunSummary summary = run(longer, options("a"));
  EXPECT_EQ(summary.reused, 0U);
  ASSERT_EQ(messages_.size(), 1U);
  EXPECT_THAT(messages_[0], HasSubstr("12 finished trials"));
  EXPECT_EQ(records::read_trials(folder_ / "a").size(), 24U);
  const auto shown = records::read_planned_trials(folder_ / "a");
  ASSERT_EQ(shown.size(), 12U);
  EXPECT_EQ(shown[0].trial, longer.plan.trials[0].id);
  EXPECT_THAT(messages_[0], HasSubstr("an earlier version of the suite"));
  // The same folder for the suite of another file.
  messages_.clear();
  PreparedPlan other = prepared(suite_text("\"toy-walker\"", R"(, "seed": 3)"));
  other.plan.suite.file = "elsewhere/toy.json";
  run(other, options("a"));
  EXPECT_THAT(messages_,
              Contains(AllOf(HasSubstr("belong to another suite, "), HasSubstr("(this one is elsewhere/toy.json)"))));
  // With the first suite again: nothing is lost.
  EXPECT_EQ(run(prepared(suite_text("\"toy-walker\"")), options("a")).reused, 12U);
}

TEST_F(RunAgainTest, ReportsANewProgramAndKeepsResults) {
  const PreparedPlan plan = prepared(suite_text("\"toy-walker\""));
  run(plan, options("a"));
  Json manifest = records::read_manifest_json(folder_ / "a");
  manifest["program"]["hash"] = std::string(64, '0');
  write_file_atomically(folder_ / "a" / "manifest.json", manifest.dump());
  EXPECT_EQ(run(plan, options("a")).reused, 12U);
  ASSERT_EQ(messages_.size(), 1U);
  EXPECT_THAT(messages_[0], HasSubstr("results from 2 builds of relign-bench; 12 finished trials are kept"));
  EXPECT_EQ(records::read_manifest_json(folder_ / "a")["earlier_programs"][0]["hash"], std::string(64, '0'));
  run(plan, options("a"));
  EXPECT_THAT(messages_, SizeIs(2)) << "the results are still from two builds";
  EXPECT_THAT(records::read_manifest_json(folder_ / "a")["earlier_programs"], SizeIs(1));
}

TEST_F(RunAgainTest, RejectsTwoRunsIntoOneFolder) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  const records::ResultsWriter other(folder_ / "a");
  EXPECT_THAT(error_text(ErrorKind::io, [&] { run(plan, options("a")); }), HasSubstr("another run is writing"));
}

}  // namespace
}  // namespace relign::runner
