#include "cli/interrupt.h"

#include <signal.h>
#include <unistd.h>

#include <string_view>

#include "cli/exit_codes.h"

namespace relign::cli {
namespace {

std::atomic<bool> stop_requested{false};
std::atomic<int> stop_signal{0};
bool on_terminal = false;  // set before the handlers are installed
constexpr std::string_view kStopping = "\nstopping; a second Ctrl-C ends at once\n";
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free,
              "signal handlers may touch lock-free atomics only");

// The handler stays installed, because plugins are checked for changed handlers after every trial.
void on_signal(int number) {
  if (stop_requested.exchange(true)) _exit(128 + number);
  stop_signal = number;
  if (on_terminal && write(STDERR_FILENO, kStopping.data(), kStopping.size()) < 0) return;
}

}  // namespace

const std::atomic<bool>& watch_for_stop() {
  on_terminal = isatty(STDERR_FILENO) == 1;
  struct sigaction action = {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  return stop_requested;
}

int stop_exit_code() { return stop_signal == SIGINT ? kInterrupted : kStopped; }

}  // namespace relign::cli
