// Runs a trial in this process and reports a plugin that ends the process.
#pragma once

#include "trials/trial.h"

namespace relign::cli {

// trials::run_trial, but prints an error if a plugin calls exit (exit code kTrialsFailed) or crashes (the signal then
// ends the process). keep_stdout: redirects the plugins' output to stderr, because stdout carries a document.
trials::TrialResult run_guarded(const trials::TrialSetup& setup, bool keep_stdout);

}  // namespace relign::cli
