// Plugins that are one file: a Python script whose class is the manifest (`python3 FILE --manifest`).
#pragma once

#include <filesystem>

#include "plugin_host/manifest.h"

namespace relign::plugin_host {

// True for a path that ends like such a file, whether it exists or not.
bool is_plugin_script(const std::filesystem::path& path);

// Runs the script for its manifest, or reads what it said last time: the answer is kept in the cache
// folder under the hash of the file and of relign_bench. Throws Error(plugin_refused).
Manifest read_script_manifest(const std::filesystem::path& script);

}  // namespace relign::plugin_host
