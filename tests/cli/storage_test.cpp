// Results on a full disk, in a read-only folder, and after their plugin was removed.
#include <gmock/gmock.h>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class CliStorage : public testing::Test {
 protected:
  void SetUp() override {
    place_.write("suites/tiny.json", kSmallestSuite);
    ASSERT_EQ(relign_bench(place_, {"run", "suites/tiny.json", "-o", "one"}).exit_code, 0);
  }
  std::map<std::string, std::string> contents(const std::string& folder) const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(place_.path(folder)))
      if (entry.is_regular_file()) {
        const std::string name = fs::relative(entry.path(), place_.folder()).string();
        files[name] = place_.read(name);
      }
    return files;
  }
  // Runs a shell script in a mount namespace of its own. False if that is not permitted.
  bool with_mounts(const std::string& script) {
    if (shell(place_, "unshare -m mount -t tmpfs none /mnt").exit_code != 0) return false;
    place_.write("script", script);
    const Outcome outcome = shell(place_, "unshare -m sh -e ./script");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return true;
  }
  Workplace place_;
};

TEST_F(CliStorage, ResumesAfterFullDisk) {
  if (!with_mounts(
          "mkdir small\n"
          "mount -t tmpfs -o size=64k none small\n"
          "code=0; \"$RELIGN_BENCH\" run suites/tiny.json -o small/full 2>full.err || code=$?; echo $code >full.code\n"
          "code=0; \"$RELIGN_BENCH\" run suites/tiny.json -o small/full 2>still.err || code=$?; echo $code "
          ">still.code\n"
          "mount -o remount,size=20m small\n"
          "\"$RELIGN_BENCH\" run suites/tiny.json -o small/full 2>again.err\n"
          "cp -r small/full full\n"))
    GTEST_SKIP() << "needs a small file system, which only root may mount";
  for (const char* time : {"full", "still"}) {
    EXPECT_EQ(place_.read(time + std::string(".code")), "2\n");
    EXPECT_THAT(place_.read(time + std::string(".err")),
                AllOf(HasSubstr("small/full"), HasSubstr("No space left on device")));
  }
  for (const char* table : {"instances.csv", "curves.json"})
    EXPECT_EQ(place_.read(std::string("full/") + table), place_.read(std::string("one/") + table)) << table;
  EXPECT_EQ(place_.read("full/trials/0000.jsonl"), place_.read("one/trials/0000.jsonl"));
  EXPECT_EQ(place_.read("full/curves.csv"), place_.read("one/curves.csv"));
}

TEST_F(CliStorage, LeavesReadOnlyFolderUnchanged) {
  const auto before = contents("one");
  if (!with_mounts("mount --bind one one\n"
                   "mount -o remount,ro,bind one\n"
                   "code=0; \"$RELIGN_BENCH\" run suites/tiny.json -o one 2>run.err || code=$?; echo $code >run.code\n"
                   "code=0; \"$RELIGN_BENCH\" report one 2>report.err || code=$?; echo $code >report.code\n"
                   "code=0; \"$RELIGN_BENCH\" merge one -o one/merged 2>merge.err || code=$?; echo $code >merge.code\n"
                   "\"$RELIGN_BENCH\" report one -o page.html\n"
                   "\"$RELIGN_BENCH\" verify one --sample 2\n"))
    GTEST_SKIP() << "needs a read-only file system, which only root may mount";
  for (const char* verb : {"run", "report", "merge"}) {
    EXPECT_EQ(place_.read(verb + std::string(".code")), "2\n") << verb;
    EXPECT_THAT(place_.read(verb + std::string(".err")), AllOf(HasSubstr("one"), HasSubstr("Read-only file system")))
        << verb;
  }
  EXPECT_EQ(contents("one"), before);
  EXPECT_THAT(place_.read("page.html"), HasSubstr("<html"));
}

TEST_F(CliStorage, KeepsResultsOfRemovedPlugin) {
  fs::copy(RELIGN_BREAKS_DOWN, place_.path("mine"), fs::copy_options::recursive);
  place_.write("suites/mine.json",
               R"({"scenes": ["relign_od"], "noise_levels": ["rho0"], "algorithms": ["../mine", "random"],
                                        "instances": 2, "steps": 3})");
  EXPECT_EQ(relign_bench(place_, {"run", "suites/mine.json", "-o", "two"}).exit_code, 3) << "breaks_down fails";
  const auto before = contents("two");
  fs::remove_all(place_.path("mine"));
  const Outcome gone = relign_bench(place_, {"run", "suites/mine.json", "-o", "two"});
  EXPECT_EQ(gone.exit_code, 2);
  EXPECT_THAT(gone.err, AllOf(HasSubstr("suites/mine.json:1:"), HasSubstr("mine")));
  EXPECT_EQ(contents("two"), before);
  EXPECT_EQ(relign_bench(place_, {"report", "two"}).exit_code, 0);
  EXPECT_EQ(contents("two").at("two/trials/0000.jsonl"), before.at("two/trials/0000.jsonl"));
  const Outcome verified = relign_bench(place_, {"verify", "two"});
  EXPECT_NE(verified.exit_code, 0);
  EXPECT_THAT(verified.err, HasSubstr("mine"));
}

}  // namespace
}  // namespace relign::cli_test
