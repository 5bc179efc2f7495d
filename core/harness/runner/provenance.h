// The content of manifest.json: suite, plugins, program and machine of a run (results/README.md).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "records/manifest.h"
#include "runner/run.h"

namespace relign::runner {

// SHA-256 of each plugin of the plan, by the path of its library.
using LibraryHashes = std::map<std::string, std::string>;
LibraryHashes hash_libraries(const suites::Suite& suite);
// Of a plugin with the algorithms that it runs: when any of them changes, its trials run again.
std::string hash_of(const plugin_host::Choice& choice, const LibraryHashes& hashes);

// "anywhere" or "this_cpu": where its results are reproducible, by the manifests of the plugin and of the algorithms
// that it runs, and the file beside its model (plugin_host/training.h).
std::string reproducible_of(const plugin_host::Choice& choice);

records::Program this_program();
records::Machine this_machine();

MachineTimeKeys keys_of(const trials::MachineTime& times);

// The limits of a sandbox and what it showed besides the plugins.
records::SandboxLimits limits_of(const plugin_host::Sandbox& sandbox);

// learnt: the pretrained data of the plan's algorithms.
records::Manifest make_manifest(const PreparedPlan& prepared, const LibraryHashes& hashes, const std::string& command,
                                std::vector<records::Pretrained> learnt);

}  // namespace relign::runner
