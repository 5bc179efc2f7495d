// What this process may use of the machine.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace relign {

// Main memory in bytes: the machine's, or less where a control group (a container, a queue's job) allows less.
// `cgroups`: where the system mounts them.
std::size_t usable_memory_bytes(const std::filesystem::path& cgroups = "/sys/fs/cgroup",
                                const std::filesystem::path& own_groups = "/proc/self/cgroup");

// The processor's maker and the instruction sets for which libraries (OpenCV, Embree, the C library's mathematics)
// choose other code at run time, such as "intel: sse3 ssse3 ...". Where this is equal, results are equal bit for bit;
// the maker counts because approximate reciprocals differ between makers.
std::string instruction_sets();

// Processors that this process may run on, at least 1.
unsigned core_count();

}  // namespace relign
