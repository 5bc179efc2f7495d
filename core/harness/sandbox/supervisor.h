// Process 1 of a sandbox: starts the plugin, reaps orphans, and ends all of them when the plugin ends or when they use
// more processes or memory than granted.
#pragma once

#include <cstddef>

namespace relign::sandbox {

struct Limits {
  std::size_t memory_bytes = 0;  // of all processes together; 0: no limit
  std::size_t processes = 64;
  std::size_t disk_bytes = std::size_t{256} << 20;
};

// Starts `command` in `folder`, with the descriptors of a plugin, and returns its wait status once it has ended or was
// ended. Everything else in the process namespace ends with the caller.
int supervise(char** command, const char* folder, const Limits& limits);

}  // namespace relign::sandbox
