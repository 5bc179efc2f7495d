// Plugins that are one file: a Python script whose class is the manifest (`python3 FILE --manifest`).
#pragma once

#include <filesystem>
#include <string>

#include "plugin_host/manifest.h"

namespace relign::plugin_host {

// True for a path that ends like such a file, whether it exists or not.
bool is_plugin_script(const std::filesystem::path& path);

// Runs the script for its manifest, or reads what it said last time: the answer is kept in the cache
// folder under the hash of the file and of relign_bench, and counts as long as the modules that it imported from its
// own folder are what they were. Their hashes stand in the manifest's text, so that plugin_hash knows them. Throws
// Error(plugin_refused).
Manifest read_script_manifest(const std::filesystem::path& script);

// The same from what the script said, which is Manifest::text of such a plugin; runs nothing.
Manifest script_manifest_of(const std::string& text, const std::filesystem::path& script);

// What a process says of itself in its handshake against the manifest that it was started by, in all that decides what
// it is given: the first difference as a sentence, empty without one.
std::string manifest_difference(const Manifest& stated, const Json& said);

}  // namespace relign::plugin_host
