#include "base/machine.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <string>
#include <vector>

#include "base/files.h"

namespace relign {
namespace {

namespace fs = std::filesystem;

TEST(InstructionSets, MatchProcCpuinfo) {
  const std::string sets = instruction_sets() + " ";
#if defined(__x86_64__)
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.rfind("flags", 0) != 0) continue;
    line += " ";
    for (const auto& [ours, systems] :
         {std::pair{"avx2", "avx2"}, std::pair{"fma", "fma"}, std::pair{"sse4.1", "sse4_1"},
          std::pair{"avx512f", "avx512f"}, std::pair{"avx512vnni", "avx512_vnni"}})
      EXPECT_EQ(sets.find(" " + std::string(ours) + " ") != std::string::npos,
                line.find(" " + std::string(systems) + " ") != std::string::npos)
          << ours;
    return;
  }
#endif
  EXPECT_NE(sets, " ");
}

class MemoryLimit : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  std::size_t found(const std::string& own_groups) {
    write_file_atomically(folder_ / "own", own_groups);
    return usable_memory_bytes(folder_ / "groups", folder_ / "own");
  }
  void limit(const std::string& file, const std::string& text) {
    write_file_atomically(folder_ / "groups" / file, text);
  }

  fs::path folder_ = fs::temp_directory_path() / ("relign-memory-" + std::to_string(::getpid()));
  std::size_t whole_ =
      static_cast<std::size_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
};

TEST_F(MemoryLimit, IsMachineMemoryWithoutControlGroups) {
  EXPECT_EQ(found(""), whole_);
  EXPECT_EQ(found("nonsense\n0::/job\n"), whole_);
  limit("job/memory.max", "max\n");
  EXPECT_EQ(found("0::/job\n"), whole_);
  limit("job/memory.max", "9000000000000000\n");  // more than there is
  EXPECT_EQ(found("0::/job\n"), whole_);
}

TEST_F(MemoryLimit, IsLowestLimitOfAllAncestors) {
  limit("slice/memory.max", "3000000\n");
  limit("slice/job/memory.max", "5000000\n");
  EXPECT_EQ(found("0::/slice/job\n"), 3000000U);
  EXPECT_EQ(found("0::/\n"), whole_);
  limit("memory.max", "2000000\n");  // in a container the own group may be the root
  EXPECT_EQ(found("0::/\n"), 2000000U);
}

TEST_F(MemoryLimit, ReadsControlGroupsVersion1) {
  limit("memory/job/memory.limit_in_bytes", "4000000\n");
  EXPECT_EQ(found("5:cpu,cpuacct:/other\n4:memory:/job\n"), 4000000U);
}

TEST_F(MemoryLimit, KnowsProcessesThatTheKernelEnded) {
  write_file_atomically(folder_ / "vmstat", "nr_free_pages 12\noom_kill 3\nswap_ra 0\n");
  EXPECT_EQ(processes_ended_for_memory(folder_ / "vmstat"), 3);
  write_file_atomically(folder_ / "vmstat", "nr_free_pages 12\n");
  EXPECT_EQ(processes_ended_for_memory(folder_ / "vmstat"), -1);
  EXPECT_EQ(processes_ended_for_memory(folder_ / "missing"), -1);
}

// Sets a limit of this process for its lifetime.
class Limited {
 public:
  Limited(decltype(RLIMIT_AS) resource, rlim_t bytes) : resource_(resource) {
    ::getrlimit(resource, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    EXPECT_EQ(::setrlimit(resource, &limit), 0);
  }
  ~Limited() { ::setrlimit(resource_, &before_); }
  Limited(const Limited&) = delete;

 private:
  decltype(RLIMIT_AS) resource_;
  rlimit before_{};
};

TEST(ProcessLimit, IsTheLowestOfTheShell) {
  constexpr std::size_t kUsable = std::size_t{1} << 50;  // beyond the address space of any test
  const Limited none_here(RLIMIT_AS, RLIM_INFINITY), nor_here(RLIMIT_DATA, RLIM_INFINITY);
  EXPECT_FALSE(memory_limit(kUsable));
  const Limited space(RLIMIT_AS, kUsable / 2);
  EXPECT_EQ(memory_limit(kUsable)->bytes, kUsable / 2);
  EXPECT_EQ(memory_limit(kUsable)->set_by, "ulimit -v");
  const Limited data(RLIMIT_DATA, kUsable / 4);
  EXPECT_EQ(memory_limit(kUsable)->bytes, kUsable / 4);
  EXPECT_EQ(memory_limit(kUsable)->set_by, "ulimit -d");
  EXPECT_FALSE(memory_limit(kUsable / 8)) << "the machine has less";
}

TEST(PeakMemory, CountsFromTheLastCall) {
  EXPECT_EQ(peak_memory_bytes("/does/not/exist"), 0u);
  constexpr std::size_t kBytes = 64 << 20;
  { const std::vector<char> touched(kBytes, 1); }
  forget_peak_memory();
  const std::size_t before = peak_memory_bytes();
  ASSERT_GT(before, 0u);
  const std::vector<char> touched(kBytes, 1);
  EXPECT_GT(peak_memory_bytes(), before + kBytes / 2);
}

}  // namespace
}  // namespace relign
