#include "cli/guarded_trial.h"

#include <signal.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "cli/app.h"

namespace relign::cli {
namespace {

bool trial_under_way = false;

void tell_of_exit() {
  if (!trial_under_way) return;
  std::fputs("error: a plugin ended this process (exit) during the trial; an algorithm ends by returning from run\n",
             stderr);
  ::_exit(kTrialsFailed);
}

void tell_of_crash(int) {
  constexpr char kText[] =
      "error: a plugin crashed during the trial, and this program with it; relign-bench run gives each a process of "
      "its own, and goes on\n";
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, kText, sizeof kText - 1);
}  // the handler is gone by now: what crashed crashes again, and the shell sees it

void listen_for_crashes() {
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) {
    struct sigaction before {
    }, ours{};
    // A sanitizer's own handler knows more.
    if (::sigaction(number, nullptr, &before) != 0 || before.sa_handler != SIG_DFL) continue;
    ours.sa_handler = tell_of_crash;
    ours.sa_flags = SA_RESETHAND;
    ::sigaction(number, &ours, nullptr);
  }
}

struct UnderWay {
  explicit UnderWay(bool told) { trial_under_way = told; }
  ~UnderWay() { trial_under_way = false; }
  UnderWay(const UnderWay&) = delete;
  UnderWay& operator=(const UnderWay&) = delete;
};

class StdoutToStderr {
 public:
  explicit StdoutToStderr(bool wanted) : before_(wanted ? ::dup(STDOUT_FILENO) : -1) {
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
  static const bool registered = std::atexit(tell_of_exit) == 0;
  listen_for_crashes();
  const UnderWay under_way(registered);
  const StdoutToStderr redirected(keep_stdout);
  return trials::run_trial(setup);
}

}  // namespace relign::cli
