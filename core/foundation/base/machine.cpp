#include "base/machine.h"

#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <string>
#include <thread>
#include <utility>

#include "base/text.h"

namespace relign {
namespace fs = std::filesystem;

namespace {

constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();

// "max", a missing file and everything else that is not a number mean no limit.
std::size_t limit_in(const fs::path& file) {
  std::ifstream stream(file);
  std::size_t bytes = 0;
  return stream >> bytes ? bytes : kNoLimit;
}

// The lowest limit of the group and its ancestors.
std::size_t lowest_limit(const fs::path& root, fs::path group, const char* file) {
  std::size_t bytes = limit_in(root / file);
  for (group = group.relative_path(); !group.empty(); group = group.parent_path())
    bytes = std::min(bytes, limit_in(root / group / file));
  return bytes;
}

}  // namespace

std::size_t usable_memory_bytes(const fs::path& cgroups, const fs::path& own_groups) {
  std::size_t bytes =
      static_cast<std::size_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  // Lines are "number:controllers:path"; version 2 has the one line "0::path" (cgroups(7)).
  std::ifstream groups(own_groups);
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    const fs::path group = line.substr(second + 1);
    if (controllers == ",,")
      bytes = std::min(bytes, lowest_limit(cgroups, group, "memory.max"));
    else if (controllers.find(",memory,") != std::string::npos)
      bytes = std::min(bytes, lowest_limit(cgroups / "memory", group, "memory.limit_in_bytes"));
  }
  return bytes;
}

std::optional<ProcessLimit> memory_limit(std::size_t usable_bytes) {
  std::optional<ProcessLimit> lowest;
  for (const auto& [resource, set_by] : {std::pair{RLIMIT_AS, "ulimit -v"}, std::pair{RLIMIT_DATA, "ulimit -d"}}) {
    rlimit limit{};
    if (::getrlimit(resource, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY || limit.rlim_cur >= usable_bytes)
      continue;
    usable_bytes = limit.rlim_cur;
    lowest = ProcessLimit{usable_bytes, set_by};
  }
  return lowest;
}

std::string memory_words() {
  const std::size_t usable = usable_memory_bytes();
  const auto gigabytes = [](std::size_t bytes) { return significant(static_cast<double>(bytes) / 1e9) + " GB"; };
  if (const auto limit = memory_limit(usable))
    return gigabytes(limit->bytes) + ", the limit of this process ('" + limit->set_by + "')";
  return gigabytes(usable) + ", what this machine or its control group has";
}

std::size_t peak_memory_bytes(const fs::path& status) {
  std::ifstream stream(status);
  constexpr std::size_t kKilobyte = 1024;
  std::size_t kilobytes = 0;
  for (std::string line; std::getline(stream, line);)
    if (line.rfind("VmHWM:", 0) == 0) kilobytes = std::strtoull(line.c_str() + 6, nullptr, 10);
  return kilobytes * kKilobyte;
}

void forget_peak_memory() { std::ofstream("/proc/self/clear_refs") << "5"; }  // proc(5)

long long processes_ended_for_memory(const fs::path& statistics) {
  std::ifstream stream(statistics);
  std::string name;
  for (long long value = 0; stream >> name >> value;)
    if (name == "oom_kill") return value;
  return -1;
}

std::string instruction_sets() {
#if defined(__x86_64__)
  std::string text = __builtin_cpu_is("intel") ? "intel:" : __builtin_cpu_is("amd") ? "amd:" : "x86-64:";
  // The builtin accepts string literals only.
#define RELIGN_ADD_SET(name) text += __builtin_cpu_supports(name) ? " " name : ""
  RELIGN_ADD_SET("sse3");
  RELIGN_ADD_SET("ssse3");
  RELIGN_ADD_SET("sse4.1");
  RELIGN_ADD_SET("sse4.2");
  RELIGN_ADD_SET("avx");
  RELIGN_ADD_SET("fma4");
  RELIGN_ADD_SET("fma");
  RELIGN_ADD_SET("avx2");
  RELIGN_ADD_SET("avx512f");
  RELIGN_ADD_SET("avx512cd");
  RELIGN_ADD_SET("avx512bw");
  RELIGN_ADD_SET("avx512dq");
  RELIGN_ADD_SET("avx512vl");
  RELIGN_ADD_SET("avx512vnni");
  RELIGN_ADD_SET("avx512bf16");
#undef RELIGN_ADD_SET
  return text;
#else
  utsname system{};
  return ::uname(&system) == 0 ? system.machine : "unknown";
#endif
}

unsigned core_count() { return std::max(1U, std::thread::hardware_concurrency()); }

}  // namespace relign
