#include "leaderboard_verbs/submission_run.h"

#include <stdlib.h>

#include <cerrno>
#include <cstring>

#include "base/error.h"
#include "base/files.h"
#include "cli/interrupt.h"
#include "plugin_host/process_child.h"
#include "runner/run.h"
#include "runner/verify.h"
#include "submissions/environment_lock.h"
#include "submissions/evaluation_suite.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kSelfTestSeconds = 600;  // of a trial, with the start of an interpreter and its imports

submissions::Packages installed_packages(const std::string& python) {
  constexpr double kSeconds = 60;
  submissions::Packages packages;
  plugin_host::ChildProcess::Options options;
  options.command = {python, "-I", "-c",
                     "import importlib.metadata as m\n"
                     "for d in m.distributions(): print(d.metadata['Name'], d.version, sep='==')"};
  options.folder = "/";
  options.on_output = [&packages](const std::string& line) {
    if (const std::size_t equals = line.find("=="); equals != std::string::npos)
      packages[submissions::normalised_package(line.substr(0, equals))] = line.substr(equals + 2);
  };
  plugin_host::ChildProcess child(std::move(options));
  child.end(kSeconds);
  if (child.crash() != "crashed(exit 0)")
    throw Error(ErrorKind::bad_input, "'" + python + "' cannot list its packages: it " + child.how_it_ended());
  return packages;
}

Json suite_of_test(const submissions::Submission& submission, const Json& entry) {
  return {{"name", "self-test"},
          {"scenes", {submission.self_test.scene}},
          {"noise_levels", {submission.self_test.noise_level}},
          {"algorithms", {entry}},
          {"instances", 1},
          {"steps", submission.self_test.steps},
          {"trial_seconds", kSelfTestSeconds}};
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (fs::temp_directory_path() / "relign-submission-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr)
    throw Error(ErrorKind::io, "cannot create a temporary folder '" + pattern + "': " + std::strerror(errno));
  path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

void check_environment(const submissions::Submission& submission, const fs::path& folder) {
  if (submission.environment.empty()) return;
  constexpr std::size_t kMaxLockBytes = std::size_t{1} << 20;
  const submissions::Packages locked =
      submissions::read_lock(read_file(folder / submission.environment, kMaxLockBytes), submission.environment);
  const char* chosen = std::getenv("RELIGN_PYTHON");
  const std::string python = chosen && *chosen ? chosen : "python3";
  const std::string missing = submissions::missing_packages(locked, installed_packages(python));
  if (!missing.empty())
    throw Error(ErrorKind::bad_input, "'" + python + "' lacks packages of '" + submission.environment +
                                          "': " + missing +
                                          "; install that file into a virtual environment, and name its Python in "
                                          "RELIGN_PYTHON");
}

void run_self_test(Context& context, const submissions::Submission& submission, const Json& entry) {
  const TemporaryFolder scratch;
  const std::string what = "self-test of '" + submission.name + "': ";
  runner::RunOptions options;
  options.results = scratch.path() / "results";
  options.workers = 1;
  options.worker_program = {"/proc/self/exe", "worker"};
  options.only = {{"algorithm", submission.name}};
  options.cache_folder = relign::cache_folder();
  options.sandbox = context.sandbox();
  options.stop = &watch_for_stop();
  const std::string text = suite_of_test(submission, entry).dump();
  const runner::PreparedPlan prepared = runner::prepare(
      suites::read_suite(JsonSource::from_text(text, "self-test.json"), scratch.path(), context.catalog()),
      options.cache_folder, {}, options.stop, options.sandbox);
  const runner::RunSummary summary = runner::run(prepared, options);
  if (summary.stopped) throw Error(ErrorKind::stopped, "stopped");
  if (!summary.failures.empty()) throw Error(ErrorKind::bad_input, what + summary.failures.front());
  runner::VerifyOptions replay;
  replay.results = options.results;
  replay.suite_folder = scratch.path();
  replay.workers = 1;
  replay.cache_folder = options.cache_folder;
  replay.stop = options.stop;
  replay.sandbox = options.sandbox;
  const runner::VerifySummary verified = runner::verify(replay, context.catalog());
  if (verified.stopped) throw Error(ErrorKind::stopped, "stopped");
  if (!verified.differences.empty())
    throw Error(ErrorKind::bad_input, what + "a second trial differs (" +
                                          records::to_string(verified.differences.front().difference) +
                                          "); draw random numbers from the trial's seed only");
}

}  // namespace relign::cli
