#include "conformance/inspection.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <set>
#include <sstream>
#include <system_error>
#include <thread>

#include "base/error.h"
#include "base/fault.h"
#include "base/json_source.h"
#include "base/text.h"
#include "conformance/checks.h"
#include "conformance/progress.h"
#include "conformance/trial_scene.h"
#include "conformance/watchdog.h"

extern char** environ;

namespace relign::conformance {
namespace {

constexpr int kReportDescriptor = 3;  // the child's

// A file in memory that a child writes, and that we read when it has ended.
class MemoryFile {
 public:
  explicit MemoryFile(const char* name) {
    const int low = ::memfd_create(name, MFD_CLOEXEC);
    descriptor_ = low < 0 ? -1 : ::fcntl(low, F_DUPFD_CLOEXEC, 10);  // above the numbers that the child gets
    if (low >= 0) ::close(low);
    if (descriptor_ < 0)
      throw Error(ErrorKind::io, "cannot create a memory file: " + std::generic_category().message(errno));
  }
  ~MemoryFile() { ::close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  int descriptor() const { return descriptor_; }
  std::string text() const {
    std::string text(std::size_t{64} * 1024, '\0');
    const ssize_t count = ::pread(descriptor_, text.data(), text.size(), 0);
    text.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
    return text;
  }

 private:
  int descriptor_ = -1;
};

pid_t start(std::vector<std::string> command, const MemoryFile& record, const MemoryFile& messages) {
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&files, messages.descriptor(), STDERR_FILENO);
  posix_spawn_file_actions_adddup2(&files, record.descriptor(), kReportDescriptor);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  // A group of its own, so that processes started by a plugin end with it.
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  std::vector<char*> arguments;
  for (std::string& word : command) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = -1;
  const int failure = ::posix_spawn(&child, command.front().c_str(), &files, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (failure != 0)
    throw Error(ErrorKind::io, "cannot start '" + command.front() + "': " + std::generic_category().message(failure));
  return child;
}

// The child's status, or nothing when it was killed at the deadline.
std::optional<int> wait_for(pid_t child, double deadline_s) {
  using Clock = std::chrono::steady_clock;
  const auto deadline =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(deadline_s));
  int status = 0;
  bool late = false;
  while (::waitpid(child, &status, WNOHANG) == 0) {
    if (Clock::now() >= deadline) {
      late = true;
      ::kill(-child, SIGKILL);
      ::waitpid(child, &status, 0);
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  ::kill(-child, SIGKILL);  // remaining processes of the group
  return late ? std::nullopt : std::optional<int>(status);
}

std::string last_line(const std::string& text) {
  std::istringstream lines(text);
  std::string line, last;
  while (std::getline(lines, line))
    if (line.find_first_not_of(" \t\r") != std::string::npos) last = line;
  return last.substr(0, 300);
}

std::string signal_text(int number) {
  const char* name = ::sigabbrev_np(number);
  const char* meaning = ::sigdescr_np(number);
  return (name ? std::string("SIG") + name : "signal " + std::to_string(number)) +
         (meaning ? std::string(" (") + meaning + ")" : "");
}

Finding read_finding(const std::string& record, const std::string& messages, std::optional<int> status,
                     double deadline_s) {
  std::optional<Finding> finding;
  std::string where;
  std::istringstream lines(record);
  for (std::string line; std::getline(lines, line);) {
    const Json entry = parsed_json(line);
    if (!entry.is_object()) continue;
    if (entry.contains("at")) where = entry.at("at").get<std::string>();
    if (entry.contains("verdict"))
      if (const auto verdict = verdict_from_name(entry.at("verdict").get<std::string>()))
        finding = Finding{*verdict, entry.value("reason", "")};
  }
  if (!where.empty()) where.insert(0, " ");
  if (!status)
    return failed("it was ended after " + shortest(deadline_s) + " s" + where +
                  "; use a longer --deadline if it needs more time");
  if (WIFSIGNALED(*status))
    return failed((finding ? "it crashed when the process ended, with " : "it crashed" + where + " with ") +
                  signal_text(WTERMSIG(*status)));
  if (finding) return *finding;
  std::string sentence = "it ended the process" + where + " with exit status " + std::to_string(WEXITSTATUS(*status)) +
                         "; a plugin must return and never exit";
  if (const std::string message = last_line(messages); !message.empty()) sentence += " (stderr: " + message + ")";
  return failed(sentence);
}

// Why this check cannot run for this plugin, or an empty string. `broken` are the checks that failed or were skipped
// for a failure.
std::string obstacle_to(const Check& check, const std::set<std::string>& broken) {
  for (const char* needed : check.needs)
    if (broken.count(needed)) return std::string("needs '") + needed + "'";
  return "";
}

}  // namespace

bool Inspection::passed() const { return refused.empty() && count(Verdict::failed) == 0; }

unsigned Inspection::count(Verdict verdict) const {
  return static_cast<unsigned>(std::count_if(results.begin(), results.end(), [verdict](const CheckResult& result) {
    return result.finding.verdict == verdict;
  }));
}

Inspection inspect(const std::filesystem::path& plugin, const InspectionSetup& setup) {
  Inspection inspection;
  inspection.plugin = plugin.string();
  Subject subject;
  try {
    subject = open_subject(plugin);
  } catch (const Error& error) {
    inspection.refused = error.what();
    return inspection;
  }
  inspection.plugin = subject.manifest->id;
  inspection.kind = plugin_host::kind_name(subject.kind());

  if (setup.scene) {
    if (!plugin_host::is_algorithm(subject.kind()))
      throw Error(ErrorKind::bad_input, "--scene is for optimizers and agents, which are checked on it; '" +
                                            inspection.plugin + "' is of kind '" + inspection.kind + "'");
    const TrialScene opens(*setup.scene);
  }

  std::set<std::string> broken;
  for (const Check& check : all_checks()) {
    if (!check.applies(subject.kind())) continue;
    CheckResult result{check.name, check.promise, {}};
    const std::string obstacle = obstacle_to(check, broken);
    if (!obstacle.empty()) {
      result.finding = skipped(obstacle);
    } else {
      const MemoryFile record("finding");
      const MemoryFile messages("stderr");
      std::vector<std::string> command = {setup.program.string(),
                                          "plugin",
                                          "check",
                                          "--one",
                                          check.name,
                                          "--report",
                                          std::to_string(kReportDescriptor),
                                          std::filesystem::absolute(plugin).string()};
      if (setup.scene) command.insert(command.end(), {"--scene", setup.scene_option});
      const pid_t child = start(std::move(command), record, messages);
      const std::optional<int> status = wait_for(child, setup.deadline_s);
      result.finding = read_finding(record.text(), messages.text(), status, setup.deadline_s);
    }
    const bool no_object = std::string(check.name) == "creates" && result.finding.verdict == Verdict::skipped;
    if (!obstacle.empty() || no_object || result.finding.verdict == Verdict::failed) broken.insert(check.name);
    if (setup.on_result) setup.on_result(result);
    inspection.results.push_back(std::move(result));
  }
  return inspection;
}

void run_one_check(const std::filesystem::path& plugin, const std::string& name, int report_descriptor,
                   const std::optional<plugin_host::Choice>& scene) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // without a parent, the finding has no reader
  ::fcntl(report_descriptor, F_SETFD, FD_CLOEXEC);
  report_findings_to(report_descriptor);
  const Check* check = check_by_name(name);
  if (!check) throw Error(ErrorKind::bad_input, "unknown check '" + name + "'");
  Finding finding;
  try {
    Subject subject = open_subject(plugin);
    if (scene) {
      at("while the scene '" + scene->id + "' was created");
      subject.scene = std::make_shared<TrialScene>(*scene);
      at("");
    }
    finding = check->look(subject);
  } catch (const std::exception& error) {
    finding = failed(fault_text(error));
  }
  report(finding);
}

}  // namespace relign::conformance
