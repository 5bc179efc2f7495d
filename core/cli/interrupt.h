// Ctrl-C and SIGTERM as a flag that long work looks at between steps.
#pragma once

#include <atomic>

namespace relign::cli {

// From here on the first SIGINT or SIGTERM sets the flag; a second one ends the process at once.
const std::atomic<bool>& watch_for_stop();

// kInterrupted after Ctrl-C, kStopped after SIGTERM or without a signal.
int stop_exit_code();

}  // namespace relign::cli
