// Exit codes of the program, and what they mean to its user: --help and `explain` follow from the table.
#pragma once

#include <array>

#include "base/explanation.h"

namespace relign::cli {

enum ExitCode : int {
  kDone = 0,
  kInternal = 1,
  kBadInput = 2,
  kTrialsFailed = 3,
  kGateTripped = 4,
  kPluginRefused = 5,
  kStopped = 75,
  kInterrupted = 130
};

inline constexpr int kFirstSignalCode = 128;  // plus the number of the signal that ended the program

inline constexpr std::array kExitCodes = {
    Explanation{"0", "success", "", ""},
    Explanation{"1", "internal error",
                "A fault of this program, lack of memory, or a plugin that failed outside a trial: in render, scene or "
                "plugin check.",
                "If the message names a plugin, run relign-bench plugin check PLUGIN. Otherwise run relign-bench "
                "doctor, and report the message with the command."},
    Explanation{"2", "invalid arguments, suite or file",
                "An option, key or value that does not exist; a file that is missing, damaged or cannot be written. "
                "From doctor: something is wrong with the installation.",
                "The message states the place and what is allowed. Options: relign-bench VERB --help. All mistakes of "
                "a suite: relign-bench validate SUITE."},
    Explanation{
        "3", "finished, but trials failed",
        "A plugin failed, crashed or took too long in some trials; all others count. From try: its trial "
        "failed. From plugin prepare: the pretraining failed for some noise levels.",
        "Warnings and report name each failed trial and its end, for example timeout: relign-bench explain timeout. "
        "logs/ in the results folder has the output of its plugins. After a repair, add --retry-failed to the same "
        "command; trials of a plugin that changed run again without it."},
    Explanation{"4", "records differ, or a check or gate failed",
                "verify: a replay differs, a record is damaged, or nothing could be replayed. merge, submit evaluate: "
                "records of the same trial differ. run, report: a check of the records failed. compare: a condition of "
                "--gate does not hold. leaderboard build: an evaluation was left out.",
                "Read the warnings: each names the trial and what differs. Another program, processor or plugin than "
                "that of the records is the usual reason; docs/clusters.md says what may differ."},
    Explanation{
        "5", "plugin rejected",
        "A plugin was not found, could not be loaded (another interface, a missing library), failed a check, or failed "
        "in validate.",
        "relign-bench list shows the plugins that were found, relign-bench doctor the folders that were "
        "searched; --plugin PATH adds one. relign-bench plugin check PLUGIN names what is wrong."},
    Explanation{"75", "stopped, resumable",
                "SIGTERM, as a queue sends it at the end of its time. From slurm: the plan is not complete.",
                "Run the same command again: finished trials are kept."},
    Explanation{"130", "interrupted by Ctrl-C, resumable", "Ctrl-C.",
                "Run the same command again: finished trials are kept."},
    Explanation{
        "128+N", "ended by signal number N",
        "137 (SIGKILL): the system is short of memory, a queue's limit, or kill -9. 139 (SIGSEGV): a fault of "
        "this program, or of a plugin with --isolation none. 143 (SIGTERM): stopped twice. 141 (SIGPIPE): the "
        "reader of its output ended.",
        "A run resumes with the same command. Short of memory: use fewer --workers; relign-bench validate SUITE "
        "prints the memory of each."},
};

}  // namespace relign::cli
