// What was run, with what, where: the content of manifest.json (results/README.md).
#pragma once

#include <map>
#include <string>

#include "base/json_source.h"
#include "runner/run.h"

namespace relign::runner {

// SHA-256 of each plugin the plan uses, by the path of its library.
using LibraryHashes = std::map<std::string, std::string>;
LibraryHashes hash_libraries(const suites::Suite& suite);
// Of a plugin with the algorithms it runs: when any of them changes, its trials run again.
std::string hash_of(const plugin_host::Choice& choice, const LibraryHashes& hashes);

// "anywhere" or "this_cpu": where its numbers are equal, by what the plugin, the algorithms it runs, and the
// file beside its model (plugin_host/training.h) promise.
std::string reproducible_of(const plugin_host::Choice& choice);

// Of the running program: version, compiler, flags, hash (empty where the system does not show it).
Json program_json();
// cpu, instruction_sets, cores, system.
Json machine_json();

Json machine_time_json(const trials::MachineTime& times);

// learnt: what was prepared for the plan's algorithms, one object an entry.
Json make_manifest(const PreparedPlan& prepared, const LibraryHashes& hashes, const std::string& command,
                   const Json& learnt);

}  // namespace relign::runner
