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

// Gives this process and the supervisor that it forks priority over ordinary processes, where the system allows it (to
// root): the children of a plugin that forks without end come before a process that waits, and RLIMIT_NPROC does not
// hold for root. The plugin does not inherit it. Does nothing in a process that has a real-time priority already.
void outrank_plugin();

// Starts `command` in `folder`, with the descriptors of a plugin, and returns its wait status once it has ended or was
// ended. Everything else in the process namespace ends with the caller.
int supervise(char** command, const char* folder, const Limits& limits);

}  // namespace relign::sandbox
