// How a trial can end, and what that means to a user: `explain`, the table of results/README.md and the check of
// records follow from this table.
#pragma once

#include <array>
#include <string_view>

#include "base/explanation.h"

namespace relign::records {

// The first two are good ends; every other one is a failure with the steps made until then as a censored record.
inline constexpr std::size_t kGoodEnds = 2;
inline constexpr std::array kTrialEnds = {
    Explanation{"budget_spent", "the algorithm used all its steps", "", ""},
    Explanation{"finished", "the algorithm ended the trial before its steps were used up", "", ""},
    Explanation{"failed", "a plugin reported an error",
                "A parameter or a scene that the algorithm does not support, an exception in a Python plugin, a file "
                "that it could not read.",
                "Read the trial's message in the report, and its output in logs/<trial id>.txt. Repeat the trial step "
                "by step: relign-bench try ALGORITHM --noise-level LEVEL --instance NUMBER."},
    Explanation{"crashed",
                "a plugin ended its process: by a signal, as in crashed(SIGSEGV); by exiting, as in crashed(exit 0); "
                "or a sandbox ended it beyond a limit, crashed(sandbox)",
                "SIGSEGV, SIGBUS: it used memory that is not its own. SIGABRT: a failed assertion or an exception that "
                "nothing catches. SIGFPE: an integer division by zero. SIGILL: an instruction that this processor does "
                "not have. SIGKILL: most often the system is short of memory. exit: it calls exit().",
                "Read logs/<trial id>.txt. Look for the fault with relign-bench plugin check PLUGIN, or in a debugger: "
                "gdb --args relign-bench run SUITE --isolation none --only algorithm=NAME. For crashed(sandbox) the "
                "message states the limit."},
    Explanation{"timeout",
                "the trial took longer than the suite's trial_seconds, or a process plugin did not answer in time",
                "An algorithm that hangs, or is too slow for the limit on this machine; more workers than cores; a "
                "station that does not answer.",
                "Measure the algorithm's time per step with relign-bench try. Raise trial_seconds in the suite, then "
                "add --retry-failed to the command of the run."},
    Explanation{"out_of_memory", "the trial needed more memory than the suite's trial_memory_mb",
                "An algorithm that keeps every image, or a network that is loaded in each trial.",
                "Raise trial_memory_mb in the suite, or use fewer workers, then add --retry-failed to the command of "
                "the run."},
    Explanation{"protocol_error",
                "a plugin wrote into a connection that is not its own, or its process sent a malformed message",
                "A process plugin that prints to the channel of its messages, a plugin that closes or writes to file "
                "descriptors it did not open, or different versions of the plugin's library and the program.",
                "relign-bench plugin check PLUGIN names the call. Print to stderr, or use the log of the plugin "
                "interface."},
    Explanation{"overspent", "the algorithm kept requesting steps long after the last",
                "A loop in the algorithm that ignores that step() gives no observation.",
                "Return from run() when step() gives no observation: RELIGN_STOP in C, an empty optional in C++, "
                "None in Python."},
};

}  // namespace relign::records
