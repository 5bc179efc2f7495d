#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <set>
#include <thread>

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

// What a process leaves that is killed between write() and commit().
int files_of_interrupted_write(const fs::path& file) {
  AtomicFile interrupted(file);
  interrupted.write(std::string(1 << 20, 'x'));
  int files = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(file.parent_path()))
    files += entry.path() == file || is_temporary_file(entry) ? 1 : 100;
  return files;
}

// Makes open(O_TMPFILE) fail in this process, as on NFS.
void refuse_unnamed_files() {
  sock_filter code[] = {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
                        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_openat, 0, 4),
                        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, args[2])),
                        BPF_STMT(BPF_ALU | BPF_AND | BPF_K, O_TMPFILE),
                        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, O_TMPFILE, 0, 1),
                        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EOPNOTSUPP),
                        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW)};
  const sock_fprog program = {std::size(code), code};
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) != 0)
    std::exit(99);
}

TEST_F(FilesTest, InterruptedWriteLeavesNoFile) {
  if (::access("/proc/self/fd", X_OK) != 0) GTEST_SKIP() << "needs /proc";
  const int descriptor = ::open(folder_.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600);
  if (descriptor < 0) GTEST_SKIP() << "the file system of " << folder_ << " has no O_TMPFILE";
  ::close(descriptor);
  EXPECT_EQ(files_of_interrupted_write(folder_ / "new"), 0);
  write_file_atomically(folder_ / "old", "first");
  EXPECT_EQ(files_of_interrupted_write(folder_ / "old"), 1);
  EXPECT_EQ(read_file(folder_ / "old"), "first");
}

TEST_F(FilesTest, WritesByTemporaryNameWithoutUnnamedFiles) {
  const auto write = [this] {
    refuse_unnamed_files();
    if (files_of_interrupted_write(folder_ / "new") != 1) std::exit(1);
    for (const char* content : {"first", "second"}) write_file_atomically(folder_ / "new", content);
    std::exit(files_of_interrupted_write(folder_ / "new") == 2 ? 0 : 2);
  };
  EXPECT_EXIT(write(), testing::ExitedWithCode(0), "");
  EXPECT_EQ(read_file(folder_ / "new"), "second");
}

// A process killed while it replaced the file left the name.
TEST_F(FilesTest, WritingAgainRemovesTheTemporaryFile) {
  write_file_atomically(folder_ / "a", "first");
  write_file_atomically(folder_ / "a.relign-tmp", "half");
  write_file_atomically(folder_ / "a", "second");
  EXPECT_EQ(read_file(folder_ / "a"), "second");
  EXPECT_FALSE(fs::exists(folder_ / "a.relign-tmp"));
  fs::create_directory(folder_ / "folder");
  EXPECT_THROW(write_file_atomically(folder_ / "folder", "x"), Error);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 2) << "a and the folder";
}

TEST_F(FilesTest, ConcurrentWritersLeaveOneCompleteFile) {
  const auto write = [this](char letter) {
    for (int i = 0; i < 300; ++i) write_file_atomically(folder_ / "a", std::string(1000, letter));
  };
  std::thread first(write, 'x'), second(write, 'y');
  first.join();
  second.join();
  const std::string content = read_file(folder_ / "a");
  EXPECT_EQ(content, std::string(1000, content.front()));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(FilesTest, RemovesTemporaryFilesOnly) {
  const std::set<std::string> temporary = {"a.txt.relign-tmp", "deep/step-008.png.relign-tmp-aZ09xy"};
  const std::set<std::string> others = {
      "a.txt", "thesis.tmp-backup", ".relign-tmp", "a.relign-tmp.txt", "a.relign-tmp-abcde", "a.relign-tmp.abcdef",
      "deep/b"};
  for (const auto& names : {temporary, others})
    for (const std::string& name : names) write_file_atomically(folder_ / name, name);
  fs::create_directory(folder_ / "folder.relign-tmp");
  remove_temporary_files(folder_);
  for (const std::string& name : temporary) EXPECT_FALSE(fs::exists(folder_ / name)) << name;
  for (const std::string& name : others) EXPECT_TRUE(fs::exists(folder_ / name)) << name;
  EXPECT_TRUE(fs::exists(folder_ / "folder.relign-tmp"));
  remove_temporary_files(folder_ / "missing");
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
