// The content of manifest.json: suite, plugins, program and machine of a run (results/README.md).
#pragma once

#include <map>
#include <string>

#include "base/json_source.h"
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

// Of the running program: version, compiler, flags, hash (empty where unknown).
Json program_json();
// cpu, instruction_sets, cores, system.
Json machine_json();

Json machine_time_json(const trials::MachineTime& times);

// The limits of a sandbox and what it showed besides the plugins.
Json sandbox_json(const plugin_host::Sandbox& sandbox);

// learnt: the pretrained data of the plan's algorithms, one object per entry.
Json make_manifest(const PreparedPlan& prepared, const LibraryHashes& hashes, const std::string& command,
                   const Json& learnt);

}  // namespace relign::runner
