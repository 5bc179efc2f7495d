// Workers in processes: a plugin's fault affects its own trial only.
#include "runner/worker_process.h"

#include <fstream>
#include <thread>

#include "toy_suites.h"

namespace relign::runner {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

// Children of this process, including those that wait to be reaped.
std::vector<std::string> children() {
  std::vector<std::string> found;
  for (const auto& thread : fs::directory_iterator("/proc/self/task")) {
    std::ifstream list(thread.path() / "children");
    for (std::string child; list >> child;) found.push_back(child);
  }
  return found;
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

class WorkerProcessTest : public ToyTest {
 protected:
  void SetUp() override {
    ToyTest::SetUp();
    // Otherwise sanitizers turn a signal into an exit status.
    for (const char* options : {"ASAN_OPTIONS", "TSAN_OPTIONS"}) ::setenv(options, "handle_segv=0:handle_abort=0", 1);
  }

  RunOptions options(const std::string& name, unsigned workers = 1) {
    RunOptions options = ToyTest::options(name, workers);
    options.worker_program = {RELIGN_PROGRAM, "worker"};
    return options;
  }

  static std::string saboteur(const std::string& deed) {
    return R"({"use": "toy-saboteur", "name": ")" + deed + R"(", "parameters": {"deed": ")" + deed + "\"}}";
  }

  // Runs a saboteur and a walker with two workers.
  RunSummary sabotage(const std::string& deed, const std::string& more = "") {
    return run(prepared(suite_text("\"toy-walker\", " + saboteur(deed), more)), options(deed, 2));
  }

  // The walker's records, which must be unaffected.
  std::vector<std::string> walked(const std::string& name) const {
    std::vector<std::string> lines;
    for (const records::TrialRecord& record : records::read_trials(folder_ / name))
      if (record.algorithm == "toy-walker") lines.push_back(records::to_lines(record));
    return lines;
  }

  std::vector<records::TrialRecord> of_saboteur(const std::string& name) const {
    std::vector<records::TrialRecord> found;
    for (records::TrialRecord& record : records::read_trials(folder_ / name))
      if (record.algorithm != "toy-walker") found.push_back(std::move(record));
    return found;
  }

  void expect_nothing_left(const std::string& name) {
    EXPECT_THAT(children(), IsEmpty());
    for (const auto& [file, bytes] : contents(name)) {
      EXPECT_THAT(file, testing::Not(HasSubstr(".tmp")));
      EXPECT_THAT(file, testing::Not(HasSubstr(".new")));
    }
  }
};

TEST_F(WorkerProcessTest, MeasuresTheMtfLikeAThread) {
  const PreparedPlan plan = prepared(mtf_suite(R"({"rmse": 0.1, "mtf": {"lp_per_mm": 4}})"));
  run(plan, options("process", 2));
  run(plan, ToyTest::options("thread"));
  const std::string lines = read_file(folder_ / "process/trials/0000.jsonl");
  EXPECT_THAT(lines, HasSubstr("\"mtf_centre\":"));
  EXPECT_THAT(lines, HasSubstr("\"own_optimum_mtf_corner\":"));
  EXPECT_EQ(lines, read_file(folder_ / "thread/trials/0000.jsonl"));
}

struct Deed {
  const char* name;
  const char* end;
  const char* message;
  std::size_t steps;
};

class SaboteurTest : public WorkerProcessTest, public testing::WithParamInterface<Deed> {};

TEST_P(SaboteurTest, FailsOnlyItsTrials) {
  const Deed& deed = GetParam();
  const std::string limits = deed.name == std::string("hang")  ? R"(, "trial_seconds": 0.3)"
                             : deed.name == std::string("eat") ? R"(, "trial_memory_mb": 400)"
                                                               : "";
  const RunSummary summary = sabotage(deed.name, limits);
  EXPECT_EQ(summary.finished, 24U);
  EXPECT_FALSE(summary.stopped);
  const std::vector<records::TrialRecord> trials = of_saboteur(deed.name);
  ASSERT_EQ(trials.size(), 12U);
  for (const records::TrialRecord& trial : trials) {
    EXPECT_EQ(trial.end, deed.end) << trial.message;
    EXPECT_THAT(trial.message, HasSubstr(deed.message));
    // Without a memory limit by the system, the worker's memory is polled, and it is ended in the middle of a step.
    if (!(kSanitized && trial.end == "out_of_memory")) {
      EXPECT_EQ(trial.steps.size(), deed.steps);
    }
    EXPECT_EQ(trial.own_optimum.pose, records::read_trials(folder_ / deed.name).front().own_optimum.pose);
  }
  EXPECT_EQ(summary.failed, records::ended_well(deed.end) ? 0U : 12U);
  run(prepared(suite_text("\"toy-walker\"")), ToyTest::options("undisturbed"));
  EXPECT_EQ(walked(deed.name), walked("undisturbed"));
  expect_nothing_left(deed.name);
}

INSTANTIATE_TEST_SUITE_P(
    Deeds, SaboteurTest,
    testing::Values(Deed{"none", "budget_spent", "", 6},
                    Deed{"crash", "crashed(SIGSEGV)", "killed by SIGSEGV after step 1", 2},
                    Deed{"abort", "crashed(SIGABRT)", "SIGABRT", 2}, Deed{"hang", "timeout", "0.3 s", 2},
                    Deed{"eat", "out_of_memory", "400 MB", 3}, Deed{"babble", "protocol_error", "not a message", 6},
                    Deed{"scribble", "protocol_error", "changed by another writer", 0},
                    Deed{"overspend", "overspent", "100000 requests", 6},
                    Deed{"insist", "overspent", "never returned", 5}, Deed{"nan", "failed", "finite", 3},
                    Deed{"leave_bounds", "budget_spent", "", 6}, Deed{"floating_point", "budget_spent", "", 6},
                    Deed{"locale", "budget_spent", "", 6}, Deed{"folder", "budget_spent", "", 6},
                    Deed{"handlers", "budget_spent", "", 6}, Deed{"print", "budget_spent", "", 6},
                    Deed{"exit", "crashed(exit 0)", "exit status 0", 2}, Deed{"leak", "budget_spent", "", 6},
                    Deed{"start_process", "budget_spent", "", 6},
                    Deed{"kill", "crashed(SIGKILL)", "3 times, not by this run; ", 2}),
    [](const testing::TestParamInfo<Deed>& deed) { return std::string(deed.param.name); });

TEST_F(WorkerProcessTest, WritesTheSameAsThreads) {
  const PreparedPlan plan = prepared(suite_text(kWalkers));
  run(plan, ToyTest::options("threads", 2));
  const auto threads = contents("threads");
  EXPECT_GT(threads.size(), 10U);
  for (const unsigned workers : {1U, 2U, 5U}) {
    const std::string name = "processes-" + std::to_string(workers);
    run(plan, options(name, workers));
    EXPECT_EQ(contents(name), threads) << name;
  }
  EXPECT_THAT(children(), IsEmpty());
}

// Messages to the worker and back take time, even if this side wakes up late.
TEST_F(WorkerProcessTest, RecordsHarnessTime) {
  run(prepared(suite_text("\"toy-walker\"")), options("a", 4));
  for (const records::TrialTimes& times : records::read_times(folder_ / "a")) EXPECT_GT(times.harness_seconds, 0);
}

TEST_F(WorkerProcessTest, LogsOutputOfPlugins) {
  sabotage("print");
  for (const records::TrialRecord& trial : of_saboteur("print"))
    EXPECT_EQ(read_file(folder_ / "print" / records::log_file(trial.trial)),
              "printed: without a line end\nprinted: from a stream\nprinted: to stderr\n");
}

TEST_F(WorkerProcessTest, StopEndsAHangingTrial) {
  std::atomic<bool> stop{false};
  RunOptions wanted = options("stopped");
  wanted.stop = &stop;
  std::thread user([&stop] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    stop = true;
  });
  const RunSummary summary = run(prepared(suite_text(saboteur("hang"))), wanted);
  user.join();
  EXPECT_TRUE(summary.stopped);
  EXPECT_EQ(summary.finished, 0U);
  EXPECT_THAT(children(), IsEmpty());
}

TEST_F(WorkerProcessTest, RejectsChangedLibrary) {
  const PreparedPlan plan = prepared(suite_text("\"toy-walker\""));
  LibraryHashes hashes = hash_libraries(plan.plan.suite);
  for (auto& [library, hash] : hashes)
    if (library.find("toy_walker") != std::string::npos) hash = std::string(64, '0');
  WorkerOptions with;
  with.results = folder_ / "none";
  ProcessWorker worker(plan, hashes, {RELIGN_PROGRAM, "worker"}, {}, with);
  EXPECT_THAT(error_text(ErrorKind::plugin_rejected, [&] { worker.run(plan.plan.trials.front(), nullptr); }),
              testing::AllOf(HasSubstr("toy_walker.so"), HasSubstr("has changed during this run")));
}

TEST_F(WorkerProcessTest, EndsTheRunIfAWorkerCannotStart) {
  RunOptions wanted = options("a");
  wanted.worker_program = {"/bin/false"};
  EXPECT_THAT(error_text(ErrorKind::internal, [&] { run(prepared(suite_text("\"toy-walker\"")), wanted); }),
              HasSubstr("did not start"));
}

}  // namespace
}  // namespace relign::runner
