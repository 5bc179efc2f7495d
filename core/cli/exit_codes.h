// What the program's exit status says to scripts.
#pragma once

namespace relign::cli {

enum ExitCode : int {
  kDone = 0,
  kInternal = 1,
  kBadInput = 2,       // arguments, suite, data files, folders that cannot be read or written
  kTrialsFailed = 3,   // done, but some trials failed
  kGateTripped = 4,    // done, but results that should be equal are not, or a comparison's limit was exceeded
  kPluginRefused = 5,  // a plugin could not be found, loaded or trusted
  kStopped = 75,       // stopped early; the same command goes on
  kInterrupted = 130   // Ctrl-C; the same command goes on
};

}  // namespace relign::cli
