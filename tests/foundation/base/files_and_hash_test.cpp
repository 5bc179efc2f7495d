#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "base/error.h"
#include "base/files.h"
#include "base/hash.h"

namespace relign {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class FilesTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("relign-files-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(FilesTest, WritesWholeFilesWithoutLeftovers) {
  write_file_atomically(folder_ / "deep" / "a.txt", std::string("x\0y", 3));
  EXPECT_EQ(read_file(folder_ / "deep" / "a.txt"), std::string("x\0y", 3));
  write_file_atomically(folder_ / "deep" / "a.txt", "second");
  EXPECT_EQ(read_file(folder_ / "deep" / "a.txt"), "second");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "deep"), fs::directory_iterator()), 1);
}

TEST_F(FilesTest, ErrorsNamePathAndReason) {
  try {
    read_file(folder_ / "missing");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::io);
    EXPECT_THAT(error.what(), HasSubstr("missing': No such file or directory"));
  }
  EXPECT_THROW(read_file(folder_), Error);
  EXPECT_THROW(write_file_atomically("/proc/nothing/here", "x"), Error);
  EXPECT_THROW(write_file_atomically("/dev/full/x", "x"), Error);
}

TEST_F(FilesTest, StopsReadingAtTheLimit) {
  write_file_atomically(folder_ / "ten", "0123456789");
  EXPECT_EQ(read_file(folder_ / "ten", 10), "0123456789");
  for (const fs::path& file : {folder_ / "ten", fs::path("/dev/zero")}) {
    try {
      read_file(file, 9);
      FAIL() << file;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      EXPECT_THAT(error.what(), HasSubstr("the file is larger than 9 bytes"));
    }
  }
}

TEST_F(FilesTest, CacheFolderFollowsXdg) {
  ::setenv("XDG_CACHE_HOME", folder_.c_str(), 1);
  EXPECT_EQ(cache_folder(), folder_ / "relign-bench");
  ::setenv("XDG_CACHE_HOME", "/proc/nothing", 1);
  EXPECT_EQ(cache_folder(), fs::path()) << "not writable";
}

TEST_F(FilesTest, FindsTheFirstProgramOnPath) {
  for (const char* name : {"a/tool", "b/tool", "b/data"}) write_file_atomically(folder_ / name, "#!/bin/sh\n");
  fs::permissions(folder_ / "b/tool", fs::perms::owner_all);
  ::setenv("PATH", (":" + (folder_ / "a").string() + ":" + (folder_ / "b").string()).c_str(), 1);
  EXPECT_EQ(program_on_path("tool"), folder_ / "b/tool");
  EXPECT_EQ(program_on_path("data"), "");
}

// FIPS 180-2, appendix B.
TEST(Hash, MatchesKnownAnswers) {
  EXPECT_EQ(sha256_hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(short_hash("abc"), "ba7816bf8f01cfea");
}

}  // namespace
}  // namespace relign
