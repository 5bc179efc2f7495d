#include "submissions/archive.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <fstream>

#include "base/error.h"
#include "base/files.h"
#include "hostile_archives.h"
#include "refusal.h"

namespace relign::submissions {
namespace {

namespace fs = std::filesystem;
using submissions_test::ArchiveMaker;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class SubmissionArchive : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::path(testing::TempDir()) / "relign_archive_XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  void TearDown() override { fs::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  std::vector<std::string> files() const { return files_to_pack(folder_ / "in", ""); }
  fs::path folder_;
};

TEST_F(SubmissionArchive, EveryHostileArchiveIsRefusedInOneSentenceAndLeavesNothing) {
  for (const submissions_test::Hostile& hostile : submissions_test::hostile_archives()) {
    SCOPED_TRACE(hostile.name);
    const fs::path archive = folder_ / "hostile.tar.gz";
    hostile.write(archive);
    const std::string message = refusal([&] { unpack_archive(archive, folder_ / "out"); });
    EXPECT_THAT(message, HasSubstr(hostile.refusal));
    EXPECT_THAT(message, HasSubstr("archive '" + archive.string() + "' is refused: "));
    EXPECT_THAT(message, Not(HasSubstr("\n")));
    EXPECT_THAT(message, Not(HasSubstr("\x1b")));
    EXPECT_FALSE(fs::exists(folder_ / "out"));
    EXPECT_FALSE(fs::exists(folder_ / "escaped"));
    EXPECT_FALSE(fs::exists("/tmp/relign_escaped"));
    fs::remove(archive);
    EXPECT_TRUE(fs::is_empty(folder_));
  }
}

TEST_F(SubmissionArchive, LimitsHoldToTheByteAndTheFile) {
  ArchiveLimits limits;
  limits.entries = 2;
  limits.file_bytes = 10;
  limits.total_bytes = 15;
  const auto unpack = [&](const std::vector<std::string>& contents) {
    {
      ArchiveMaker maker(folder_ / "a.tar.gz");
      for (std::size_t i = 0; i < contents.size(); ++i) maker.add("f" + std::to_string(i), contents[i]);
    }
    fs::remove_all(folder_ / "out");
    return refusal([&] { unpack_archive(folder_ / "a.tar.gz", folder_ / "out", limits); });
  };
  {
    ArchiveMaker maker(folder_ / "fits.tar");
    maker.add("a", "0123456789");
    maker.add("b", "01234");
  }
  unpack_archive(folder_ / "fits.tar", folder_ / "fits", limits);
  EXPECT_EQ(read_file(folder_ / "fits/b"), "01234");
  EXPECT_THAT(unpack({"0123456789a"}), HasSubstr("at most 10 bytes a file are allowed"));
  EXPECT_THAT(unpack({"0123456789", "012345"}), HasSubstr("at most 15 bytes together are allowed"));
  EXPECT_THAT(unpack({"", "", ""}), HasSubstr("at most 2 entries are allowed"));
  limits.archive_bytes = 20;
  EXPECT_THAT(unpack({"x"}), HasSubstr("at most 20 bytes are allowed"));
}

TEST_F(SubmissionArchive, RefusesNamesThatDifferInCaseOnly) {
  for (const auto& [first, second] : {std::pair("Plugin.py", "plugin.py"), std::pair("Data/a", "data/b")}) {
    {
      ArchiveMaker maker(folder_ / "a.tar");
      maker.add(first, "1");
      maker.add(second, "2");
    }
    EXPECT_THAT(refusal([&] { unpack_archive(folder_ / "a.tar", folder_ / "out"); }),
                HasSubstr("in upper and lower case only"));
    EXPECT_FALSE(fs::exists(folder_ / "out"));
  }
}

TEST_F(SubmissionArchive, ShowsNamesWithControlCharactersOnOneLine) {
  {
    ArchiveMaker maker(folder_ / "a.tar");
    maker.add("a\nerror: forged\x1b[2J", "1");
  }
  const std::string message = refusal([&] { unpack_archive(folder_ / "a.tar", folder_ / "out"); });
  EXPECT_THAT(message, HasSubstr("entry 'a?error: forged\\x1b[2J'"));
}

TEST_F(SubmissionArchive, EqualFilesGiveEqualBytes) {
  write("in/b.py", "second");
  write("in/a/model.bin", std::string(100'000, 'm'));
  for (const char* name : {"one.tar", "one.tar.gz", "one.tar.zst"}) {
    pack_archive(folder_ / "in", files(), folder_ / name);
    const std::string first = read_file(folder_ / name);
    // Other times, another order of creation.
    fs::remove_all(folder_ / "in");
    write("in/a/model.bin", std::string(100'000, 'm'));
    write("in/b.py", "second");
    fs::last_write_time(folder_ / "in/b.py", fs::file_time_type::clock::now() - std::chrono::hours(1000));
    pack_archive(folder_ / "in", files(), folder_ / name);
    EXPECT_EQ(read_file(folder_ / name), first) << name;
    EXPECT_LT(first.size(), std::string(name) == "one.tar" ? 110'000U : 1'000U) << name;
  }
}

TEST_F(SubmissionArchive, UnpacksWhatWasPacked) {
  const std::string binary("\0\xff\n", 3);
  write("in/deep/er/model.bin", binary);
  write("in/run.sh", "#!/bin/sh\n");
  write("in/empty", "");
  fs::permissions(folder_ / "in/run.sh", fs::perms::owner_exec, fs::perm_options::add);
  pack_archive(folder_ / "in", files(), folder_ / "a.tar.zst");
  unpack_archive(folder_ / "a.tar.zst", folder_ / "out");
  EXPECT_EQ(read_file(folder_ / "out/deep/er/model.bin"), binary);
  EXPECT_EQ(read_file(folder_ / "out/empty"), "");
  struct stat status = {};
  ASSERT_EQ(stat((folder_ / "out/run.sh").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0111U, 0111U & ~umask(umask(0)));
}

TEST_F(SubmissionArchive, PacksNoHiddenFilesAndNoLinks) {
  write("in/plugin.py", "x");
  write("in/.git/config", "secret");
  write("in/__pycache__/plugin.pyc", "x");
  write("in/old.tar.gz", "x");
  EXPECT_THAT(files_to_pack(folder_ / "in", folder_ / "in/old.tar.gz"), ElementsAre("plugin.py"));
  fs::create_symlink("/etc/passwd", folder_ / "in/data");
  EXPECT_THAT(refusal([&] { files(); }), HasSubstr("it is a link"));
  fs::remove(folder_ / "in/data");
  write("in/\xc3\xa4.py", "x");
  EXPECT_THAT(refusal([&] { files(); }), HasSubstr("a path must consist of letters"));
}

TEST_F(SubmissionArchive, RefusesOtherNamesOfArchives) {
  write("in/a", "x");
  EXPECT_THAT(refusal([&] { pack_archive(folder_ / "in", files(), folder_ / "a.zip"); }),
              HasSubstr("must end in .tar.zst, .tar.gz or .tar"));
  EXPECT_THAT(test::error_text(ErrorKind::io, [&] { pack_archive(folder_ / "in", files(), "/proc/none/a.tar"); }),
              HasSubstr("/proc/none"));
}

}  // namespace
}  // namespace relign::submissions
