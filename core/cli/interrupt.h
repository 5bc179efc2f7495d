// Ctrl-C and SIGTERM as a flag that long operations check.
#pragma once

#include <atomic>

namespace relign::cli {

// Installs the handlers: the first SIGINT or SIGTERM sets the flag and says so on a terminal, a second one ends the
// process immediately.
const std::atomic<bool>& watch_for_stop();

// kInterrupted after Ctrl-C, otherwise kStopped.
int stop_exit_code();

}  // namespace relign::cli
