// Plugins in one file: a Python script whose class contains the manifest (`python3 FILE --manifest`).
#pragma once

#include <filesystem>
#include <string>

#include "plugin_host/manifest.h"

namespace relign::plugin_host {

struct Sandbox;  // sandbox.h

// True for a path with the extension of such a file, whether it exists or not.
bool is_plugin_script(const std::filesystem::path& path);

// Runs the script for its manifest, or reads it from the cache folder, where it is stored under the hash of the file,
// of relign_bench and of the interpreter's name. A cached manifest is valid while the modules that the script imported
// from its own folder are unchanged. Their hashes are part of the manifest's text, and therefore of plugin_hash. Throws
// Error(plugin_rejected). With `sandbox` it runs there.
Manifest read_script_manifest(const std::filesystem::path& script, const Sandbox* sandbox = nullptr);

// The same from the text that the script printed, which is Manifest::text of such a plugin; runs nothing.
Manifest script_manifest_of(const std::string& text, const std::filesystem::path& script);

// What to do, from the line in which Python says that a module is not installed; empty for other lines.
std::string missing_module(const std::string& line);

// Compares the manifest that a process sends in its handshake with the one that it was started by, in everything that
// affects a trial. Returns a message on the first difference; empty if there is none.
std::string manifest_difference(const Manifest& stated, const Json& sent);

}  // namespace relign::plugin_host
