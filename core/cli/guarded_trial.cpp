#include "cli/guarded_trial.h"

#include <signal.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "base/own_command.h"
#include "cli/app.h"

namespace relign::cli {
namespace {

bool trial_running = false;
std::string crash_text;  // made before a crash, whose handler must not allocate

void report_exit() {
  if (!trial_running) return;
  std::fputs("error: a plugin called exit during the trial; an algorithm must end a trial by returning from run\n",
             stderr);
  ::_exit(kTrialsFailed);
}

void report_crash(int) {
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, crash_text.data(), crash_text.size());
}  // SA_RESETHAND has removed the handler, so the crash repeats and the shell sees the signal

void install_crash_handlers() {
  crash_text = "error: a plugin crashed during the trial and ended this program; '" + own_command("run") +
               "' isolates each trial in a separate process\n";
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) {
    struct sigaction before {
    }, ours{};
    // Keeps the handlers of sanitizers.
    if (::sigaction(number, nullptr, &before) != 0 || before.sa_handler != SIG_DFL) continue;
    ours.sa_handler = report_crash;
    ours.sa_flags = SA_RESETHAND;
    ::sigaction(number, &ours, nullptr);
  }
}

struct RunningTrial {
  explicit RunningTrial(bool exit_is_reported) { trial_running = exit_is_reported; }
  ~RunningTrial() { trial_running = false; }
  RunningTrial(const RunningTrial&) = delete;
  RunningTrial& operator=(const RunningTrial&) = delete;
};

class StdoutToStderr {
 public:
  explicit StdoutToStderr(bool redirect) : before_(redirect ? ::dup(STDOUT_FILENO) : -1) {
    if (before_ >= 0) ::dup2(STDERR_FILENO, STDOUT_FILENO);
  }
  ~StdoutToStderr() {
    if (before_ < 0) return;
    std::fflush(stdout);
    ::dup2(before_, STDOUT_FILENO);
    ::close(before_);
  }
  StdoutToStderr(const StdoutToStderr&) = delete;
  StdoutToStderr& operator=(const StdoutToStderr&) = delete;

 private:
  int before_;
};

}  // namespace

trials::TrialResult run_guarded(const trials::TrialSetup& setup, bool keep_stdout) {
  static const bool registered = std::atexit(report_exit) == 0;
  install_crash_handlers();
  const RunningTrial running(registered);
  const StdoutToStderr redirected(keep_stdout);
  return trials::run_trial(setup);
}

}  // namespace relign::cli
