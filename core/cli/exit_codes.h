// Exit codes of the program.
#pragma once

namespace relign::cli {

enum ExitCode : int {
  kDone = 0,
  kInternal = 1,
  kBadInput = 2,       // invalid arguments, suite or data file; unreadable or unwritable file or folder
  kTrialsFailed = 3,   // finished, but some trials failed
  kGateTripped = 4,    // finished, but records that should be equal differ, or a gate of compare failed
  kPluginRefused = 5,  // a plugin was not found, could not be loaded or failed a check
  kStopped = 75,       // stopped early; the same command resumes
  kInterrupted = 130   // Ctrl-C; the same command resumes
};

}  // namespace relign::cli
