#include "base/machine.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <string>

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

}  // namespace
}  // namespace relign
