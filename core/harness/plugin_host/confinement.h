// `--sandbox`: the process of an algorithm without network, the user's files, other processes, or the means to outlive
// its trial, with limits; docs/sandbox.md. The program relign-sandbox (harness/sandbox) builds it; this is what it is
// asked for.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "plugin_host/catalog.h"
#include "plugin_host/process_child.h"

namespace relign::plugin_host {

struct Sandbox {
  std::vector<std::filesystem::path> shown;   // read-only, besides what a plugin consists of (--sandbox-show)
  std::vector<std::filesystem::path> hidden;  // empty wherever they are: results, cache
  std::size_t memory_bytes = 0;               // of the processes of one plugin together; 0: no limit
  static constexpr std::size_t kProcesses = 64;
  static constexpr std::size_t kDiskBytes = std::size_t{256} << 20;  // in /tmp and /dev/shm together; it is memory
};

Json to_json(const Sandbox& sandbox);
Sandbox sandbox_from_json(const Json& json);

// What this machine lacks for a sandbox, with what to do; empty if nothing. Builds one, at the first call.
const std::string& sandbox_problem();

// Changes the start of a plugin's process so that it is confined. `granted` is what the plugin consists of. Throws
// Error(bad_input) for a path that would show the whole system or a home folder.
void confine(ChildProcess::Options& options, const std::vector<std::filesystem::path>& granted, const Sandbox& sandbox);

// The files of a script, which lies among others: the Python files of its folder and of the packages in it.
std::vector<std::filesystem::path> files_of_script(const std::filesystem::path& script);
// The files of a plugin with these parameters: its folder or script, and the files that parameters name, with those of
// the same stem (model.onnx and model.json).
std::vector<std::filesystem::path> files_of(const Choice& choice);

// The command that runs a library plugin as a process.
std::vector<std::string> library_command(const Manifest& manifest);
// "warning: ", "debug: " or nothing, by RELIGN_LOG_*: before a line in a trial's log, and in the output of that
// process.
std::string_view log_prefix(int level);

}  // namespace relign::plugin_host
