// What this process may use of the machine.
#pragma once

#include <cstddef>
#include <filesystem>

namespace relign {

// Main memory in bytes: the machine's, or less where a control group (a container, a queue's job) allows less.
// `cgroups`: where the system mounts them.
std::size_t usable_memory_bytes(const std::filesystem::path& cgroups = "/sys/fs/cgroup",
                                const std::filesystem::path& own_groups = "/proc/self/cgroup");

// Processors that this process may run on, at least 1.
unsigned core_count();

}  // namespace relign
