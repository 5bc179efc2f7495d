// What `try` and `plugin prepare` ask the runner's Preparer for: one algorithm on one scene, noise level and protocol,
// with what a suite would have by default.
#pragma once

#include <string>

#include "cli/workbench.h"
#include "runner/preparation.h"

namespace relign::cli {

runner::TrialJob job_for(const LoadedScene& scene, const plugin_host::Choice& level,
                         const plugin_host::Choice& algorithm, trials::Protocol protocol);

// Says on stderr what is being prepared.
runner::Preparer::Options preparer_options(const plugin_host::HostServices& services, bool again = false);

// The object of --parameters; null for an empty text. Throws Error(bad_input).
Json read_parameters(const std::string& text);

// The paper's middle level, where the scene has the two elements that it offsets.
std::string default_level(const trials::SceneFacts& scene);

}  // namespace relign::cli
