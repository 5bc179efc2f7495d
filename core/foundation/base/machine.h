// Memory, processors and instruction sets that this process may use.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace relign {

// Main memory in bytes: the machine's, or the limit of a control group (of a container or a batch job) if that is
// lower. `cgroups`: mount point of the control groups; `own_groups`: list of the groups of this process.
std::size_t usable_memory_bytes(const std::filesystem::path& cgroups = "/sys/fs/cgroup",
                                const std::filesystem::path& own_groups = "/proc/self/cgroup");

// Processes that the kernel has ended for lack of memory since the machine started, in all of its control groups; -1 if
// it does not tell. `statistics`: the kernel's.
long long processes_ended_for_memory(const std::filesystem::path& statistics = "/proc/vmstat");

// The processor's vendor and the instruction sets on which libraries (OpenCV, Embree, the C library's mathematics)
// dispatch at run time, such as "intel: sse3 ssse3 ...". Results are equal bit for bit on machines where this text is
// equal; the vendor is part of it because approximate reciprocals differ between vendors.
std::string instruction_sets();

// Number of processors that this process may run on, at least 1.
unsigned core_count();

}  // namespace relign
