// A trial in this process, where what a plugin does to its process it does to the program.
#pragma once

#include "trials/trial.h"

namespace relign::cli {

// As trials::run_trial. A plugin that calls exit gives an error and the exit code of failed trials, one that crashes an
// error before the signal does its work. keep_stdout: what plugins print goes to stderr, stdout is a document.
trials::TrialResult run_guarded(const trials::TrialSetup& setup, bool keep_stdout);

}  // namespace relign::cli
