// Pretraining jobs of `try` and `plugin prepare`: one algorithm on one scene, noise level and protocol, with the
// defaults of a suite.
#pragma once

#include <string>

#include "cli/workbench.h"
#include "runner/pretraining.h"

namespace relign::cli {

runner::TrialJob job_for(const LoadedScene& scene, const plugin_host::Choice& level,
                         const plugin_host::Choice& algorithm, trials::Protocol protocol);

// Options that print progress to stderr.
runner::Pretrainer::Options pretrainer_options(const plugin_host::HostServices& services, bool again = false);

// Parses the value of --parameters; null for an empty text. Throws Error(bad_input).
Json read_parameters(const std::string& text);

// "rho0.25", the paper's middle level, which offsets two elements; "rho0" for scenes with fewer, "none" for hardware
// stations.
std::string default_level(const trials::SceneFacts& scene);

}  // namespace relign::cli
