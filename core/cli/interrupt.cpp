#include "cli/interrupt.h"

#include <signal.h>
#include <unistd.h>

#include "cli/exit_codes.h"

namespace relign::cli {
namespace {

std::atomic<bool> stop_requested{false};
std::atomic<int> stop_signal{0};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free,
              "signal handlers may touch lock-free atomics only");

// The handler stays installed, because plugins are checked for changed handlers after every trial.
void on_signal(int number) {
  if (stop_requested.exchange(true)) _exit(128 + number);
  stop_signal = number;
}

}  // namespace

const std::atomic<bool>& watch_for_stop() {
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
