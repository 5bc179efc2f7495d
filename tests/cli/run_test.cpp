// run from suite to report: numbers, resuming, interrupts, failing algorithms.
#include <gmock/gmock.h>
#include <signal.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "cli/program.h"

namespace relign::cli_test::run_verb {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;
using testing::Not;

const std::string kCompass =
    fs::path(RELIGN_PLUGIN_DIR).parent_path().parent_path().parent_path() / "out_of_tree/compass";

// Long enough that a signal meets it at work, short enough to be run to its end twice.
const char* const kLongerSuite = R"({
  "name": "longer", "scenes": ["relign_od"], "noise_levels": ["rho0.25"],
  "algorithms": ["random", "home"], "instances": 16, "steps": 8
})";

TEST(CliRun, WritesResultsAndReport) {
  const Workplace place;
  place.write("tiny.json", kTinySuite);
  const Outcome outcome = relign_bench(place, {"run", "tiny.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("nlopt-sbplx"), HasSubstr("random"), HasSubstr("home"),
                                 HasSubstr("results/tiny/report.html")));
  EXPECT_THAT(outcome.err,
              AllOf(HasSubstr("12 of 12 trials"), HasSubstr("Next:"), HasSubstr("\n  " RELIGN_PROGRAM " try ")));
  EXPECT_THAT(outcome.out, Not(HasSubstr("Next:")));
  for (const char* file : {"manifest.json", "trials/0000.jsonl", "times/0000.jsonl", "pictures/index.json",
                           "curves.csv", "curves.json", "instances.csv", "matrix.csv", "report.html"})
    EXPECT_TRUE(fs::exists(place.path("results/tiny") / file)) << file;
}

TEST(CliRun, ResultsDoNotDependOnNumberOfWorkers) {
  const Workplace place;
  place.write("tiny.json", kTinySuite);
  for (const char* workers : {"1", "2"})
    ASSERT_EQ(relign_bench(place, {"run", "tiny.json", "--workers", workers, "-o", workers}).exit_code, 0);
  for (const char* file : {"trials/0000.jsonl", "curves.csv", "instances.csv", "matrix.csv", "pictures/index.json"}) {
    EXPECT_NE(place.read(std::string("1/") + file), "") << file;
    EXPECT_EQ(place.read(std::string("1/") + file), place.read(std::string("2/") + file)) << file;
  }
}

TEST(CliRun, ReusesEveryTrialInSecondRun) {
  const Workplace place;
  place.write("tiny.json", kTinySuite);
  ASSERT_EQ(relign_bench(place, {"run", "tiny.json"}).exit_code, 0);
  const std::string trials = place.read("results/tiny/trials/0000.jsonl");
  const Outcome again = relign_bench(place, {"run", "tiny.json", "--json", "--progress", "none"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  const json result = json::parse(again.out);
  EXPECT_EQ(result.at("trials"), 12);
  EXPECT_EQ(result.at("reused"), 12);
  EXPECT_EQ(result.at("failed"), 0);
  EXPECT_EQ(result.at("results"), "results/tiny");
  EXPECT_EQ(place.read("results/tiny/trials/0000.jsonl"), trials);
}

TEST(CliRun, OnlySelectsTrials) {
  const Workplace place;
  place.write("tiny.json", kTinySuite);
  const Outcome part = relign_bench(place, {"run", "tiny.json", "--json", "--only", "algorithm=home"});
  ASSERT_EQ(part.exit_code, 0) << part.err;
  EXPECT_EQ(json::parse(part.out).at("trials"), 4);
  const Outcome rest = relign_bench(place, {"run", "tiny.json", "--json"});
  ASSERT_EQ(rest.exit_code, 0) << rest.err;
  EXPECT_EQ(json::parse(rest.out).at("reused"), 4);
  EXPECT_EQ(json::parse(rest.out).at("trials"), 12);
}

TEST(CliRun, PrintsProgressAsJsonLines) {
  const Workplace place;
  place.write("tiny.json", kTinySuite);
  const Outcome outcome = relign_bench(place, {"run", "tiny.json", "--json", "--progress", "json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream lines(outcome.err);
  std::string line;
  json last;
  while (std::getline(lines, line)) ASSERT_NO_THROW(last = json::parse(line)) << line;
  EXPECT_EQ(last.at("total"), 12);
  EXPECT_EQ(last.at("done"), 12);
  for (const char* key : {"doing", "failed", "reused", "seconds", "per_second", "seconds_left", "seconds_left_range"})
    EXPECT_TRUE(last.contains(key)) << key;
  // Messages are JSON objects too.
  place.write("results/tiny/trials/0000.jsonl", place.read("results/tiny/trials/0000.jsonl") + "{\"trial\":\"half");
  const Outcome again = relign_bench(place, {"run", "tiny.json", "--json", "--progress", "json"});
  std::istringstream first(again.err);
  bool has_message = false;
  while (std::getline(first, line)) has_message = has_message || json::parse(line).contains("message");
  EXPECT_TRUE(has_message) << again.err;
}

TEST(CliRun, SaysHowLongItTakes) {
  const Workplace place;
  const auto run = [&place](const char* instances) {
    place.write("suite.json", std::string(R"({"name": "longer", "scenes": ["gaussian_spot"], "noise_levels": ["rho0"],
      "algorithms": ["random", "home"], "steps": 8, "instances": )") +
                                  instances + "}");
    return relign_bench(place, {"run", "suite.json", "--progress", "plain"}).err;
  };
  EXPECT_THAT(run("2"), HasSubstr("trials: 0 of 4 trials, 0 s, measuring the time left\n"));
  // With the times of the trials that there are.
  EXPECT_THAT(run("4"), HasSubstr("trials: 4 of 8 trials (4 reused), 0 s, less than 5 s left\n"));
}

// Sends a signal once the first trial is recorded; false if the run ends first.
bool signal_when_running(Running& run, const fs::path& trials, int signal) {
  for (int waited_ms = 0; waited_ms < 60000; ++waited_ms) {
    std::error_code absent;
    if (fs::exists(trials, absent) && fs::file_size(trials, absent) > 0) break;
    if (run.ended()) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  run.send(signal);
  return true;
}

void stop_and_resume(int signal, int exit_code) {
  const Workplace place;
  place.write("longer.json", kLongerSuite);
  const std::vector<std::string> command = {RELIGN_PROGRAM, "run", "longer.json", "--progress", "none"};
  Running run(place, command);
  const bool was_running = signal_when_running(run, place.path("results/longer/trials/0000.jsonl"), signal);
  const Outcome stopped = run.wait();
  ASSERT_TRUE(was_running) << stopped.err;
  ASSERT_EQ(stopped.exit_code, exit_code) << stopped.err;
  EXPECT_EQ(stopped.out, "");
  EXPECT_THAT(stopped.err, AllOf(HasSubstr("of 32 trials done"), HasSubstr("To resume, run the same command"),
                                 HasSubstr("run longer.json --progress none")));
  EXPECT_FALSE(fs::exists(place.path("results/longer/report.html")));

  const Outcome resumed = relign_bench(place, {"run", "longer.json", "--json", "--progress", "none"});
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_GT(json::parse(resumed.out).at("reused"), 0);
  EXPECT_LT(json::parse(resumed.out).at("reused"), 32);
  const Outcome whole = relign_bench(place, {"run", "longer.json", "--progress", "none", "-o", "whole"});
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_EQ(place.read("results/longer/trials/0000.jsonl"), place.read("whole/trials/0000.jsonl"));
}

TEST(CliRun, ResumesAfterCtrlC) { stop_and_resume(SIGINT, 130); }
TEST(CliRun, ResumesAfterSigterm) { stop_and_resume(SIGTERM, 75); }

TEST(CliRun, TellsTheExpectedTimeOnATerminalBeforeANewRun) {
  const Workplace place;
  place.write("tiny.json", R"({"scenes": ["relign_od"], "noise_levels": ["none"], "algorithms": ["random"],
                               "instances": 1, "steps": 2})");
  const std::string run = "TERM=xterm script -qec '" RELIGN_PROGRAM " run tiny.json' /dev/null";
  const Outcome first = shell(place, run), again = shell(place, run);
  EXPECT_EQ(first.exit_code, 0) << first.out;
  EXPECT_THAT(first.out, HasSubstr("expected time: about "));
  EXPECT_THAT(again.out, AllOf(HasSubstr("reused"), Not(HasSubstr("expected time"))));
}

TEST(CliRun, AcceptsTheVersionOfAScene) {
  const Workplace place;
  place.write("tiny.json", R"({"scenes": ["relign_od@1"], "noise_levels": ["none@1"], "algorithms": ["random@1"],
                               "instances": 1, "steps": 2})");
  EXPECT_EQ(relign_bench(place, {"run", "tiny.json"}).exit_code, 0);
  const Outcome report = relign_bench(place, {"report"});  // of the latest folder in results/
  EXPECT_EQ(report.exit_code, 0) << report.err;
  EXPECT_EQ(report.out, "results/tiny/report.html\n");
  place.write("later.json", R"({"scenes": ["relign_od@2"], "noise_levels": ["none"], "algorithms": ["random"]})");
  const Outcome refused = relign_bench(place, {"run", "later.json"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("'relign_od' has version 1 here"));
}

TEST(CliRun, RunsPluginFromFolder) {
  const Workplace place;
  place.write("own.json", R"({"scenes": ["relign_od"], "noise_levels": ["rho0"], "instances": 2, "steps": 6,
                              "algorithms": ["compass", {"use": "compass", "name": "wide", "parameters": {"first_stride": 0.3}}]})");
  const Outcome outcome = relign_bench(place, {"run", "own.json", "--plugin", kCompass});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("compass"), HasSubstr("wide"), HasSubstr("home")));
  EXPECT_THAT(outcome.err,
              AnyOf(HasSubstr("relign-bench try compass --noise-level rho0 --steps 6 --plugin "),
                    HasSubstr(R"(relign-bench try '{"use": "compass", "parameters": {"first_stride":0.3}}' )"
                              "--noise-level rho0 --steps 6 --plugin ")))
      << "the suggested trial is one of the suite";
}

TEST(CliRun, SuggestedTrialHasTheSuitesParameters) {
  const Workplace place;
  place.write("own.json", R"({"scenes": ["relign_od"], "instances": 2, "steps": 2, "algorithms": ["nlopt-sbplx"],
      "noise_levels": [{"use": "rho", "name": "three quarters", "parameters": {"level": 0.75}}]})");
  const Outcome outcome = relign_bench(place, {"run", "own.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("relign-bench try nlopt-sbplx --noise-level "
                                     R"('{"use": "rho", "parameters": {"level":0.75}}' --steps 2)"));
}

TEST(CliRun, FailingAlgorithmDoesNotStopOthers) {
  const Workplace place;
  place.write("fails.json", R"({"scenes": ["relign_od"], "noise_levels": ["rho0"], "instances": 2, "steps": 3,
                                "algorithms": ["breaks_down", "random"]})");
  const Outcome outcome = relign_bench(place, {"run", "fails.json", "--json", "--plugin", RELIGN_BREAKS_DOWN});
  ASSERT_EQ(outcome.exit_code, 3) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out).at("failed"), 2);
  EXPECT_EQ(json::parse(outcome.out).at("trials"), 6);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("breaks_down"), HasSubstr("the gripper let go")));
  EXPECT_THAT(outcome.err, HasSubstr("what to do next:\n  " RELIGN_PROGRAM " explain failed\n"));
  EXPECT_TRUE(fs::exists(place.path("results/fails/report.html")));
}

TEST(CliRun, TryReportsPluginsThatExitOrCrash) {
  ::setenv("ASAN_OPTIONS", "handle_abort=0", 1);
  const Workplace place;
  const auto tried = [&](const char* how) {
    return relign_bench(place, {"try", "breaks_down", "--plugin", RELIGN_BREAKS_DOWN, "--parameters",
                                std::string(R"({"how": ")") + how + "\"}"});
  };
  const Outcome left = tried("exit");
  EXPECT_EQ(left.exit_code, 3) << "not 0: there is no result";
  EXPECT_THAT(left.err, HasSubstr("called exit during the trial"));
  const Outcome crashed = tried("crash");
  EXPECT_EQ(crashed.exit_code, 128 + SIGABRT);
  EXPECT_THAT(crashed.err, HasSubstr("crashed during the trial"));
  const Outcome thrown = relign_bench(place, {"try", "breaks_down", "--plugin", RELIGN_BREAKS_DOWN, "--json"});
  EXPECT_EQ(thrown.exit_code, 3);
  EXPECT_EQ(json::parse(thrown.out).at("end"), "failed") << "plugin output is not in the document";
  EXPECT_THAT(thrown.err, HasSubstr("the gripper slips"));
  const Outcome page = relign_bench(place, {"describe", RELIGN_BREAKS_DOWN, "--json"});
  EXPECT_EQ(page.exit_code, 0) << page.err;
  EXPECT_EQ(json::parse(page.out).at("id"), "breaks_down") << "accepts the plugin's path";
}

}  // namespace
}  // namespace relign::cli_test::run_verb
