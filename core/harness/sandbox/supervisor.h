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

struct Ending {
  int status = 0;         // as of waitpid
  char reason[120] = "";  // why the supervisor ended the plugin; empty: it ended by itself
};

// Gives this process and the supervisor that it forks a real-time priority, where the system allows it (to root): the
// children of a plugin that forks without end come before a process that waits, and RLIMIT_NPROC does not hold for
// root. A real-time priority that it has already is kept. The plugin gets the policy that was before, never a real-time
// one.
void outrank_plugin();

// Starts `command` in `folder`, with the descriptors of a plugin, and returns once it has ended or has to be ended.
// Everything in the process namespace ends with the caller.
Ending supervise(char** command, const char* folder, const Limits& limits);

}  // namespace relign::sandbox
