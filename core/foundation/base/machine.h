// Memory, processors and instruction sets that this process may use.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

namespace relign {

// Main memory in bytes: the machine's, or the limit of a control group (of a container or a batch job) if that is
// lower. `cgroups`: mount point of the control groups; `own_groups`: list of the groups of this process.
std::size_t usable_memory_bytes(const std::filesystem::path& cgroups = "/sys/fs/cgroup",
                                const std::filesystem::path& own_groups = "/proc/self/cgroup");

// The lowest limit that the shell or a batch system sets on the memory of this process, such as {8e9, "ulimit -v"};
// none if there is none below `usable_bytes`.
struct ProcessLimit {
  std::size_t bytes = 0;
  std::string set_by;
};
std::optional<ProcessLimit> memory_limit(std::size_t usable_bytes = usable_memory_bytes());

// "25.2 GB, which this machine has" or "8.19 GB, the limit of this process ('ulimit -v')".
std::string memory_words();

// The most memory that this process has had since it began, or since forget_peak_memory(); 0 if the kernel does not
// tell. `status`: the kernel's.
std::size_t peak_memory_bytes(const std::filesystem::path& status = "/proc/self/status");
void forget_peak_memory();

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
