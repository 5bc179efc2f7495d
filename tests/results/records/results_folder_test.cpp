#include "records/results_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <thread>

#include "base/files.h"
#include "error_text.h"
#include "records/checksum.h"
#include "results/records/made_manifest.h"
#include "sample_records.h"

namespace relign::records {
namespace {

namespace fs = std::filesystem;
using test::error_text;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class ResultsFolderTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("relign-results-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static void add(ResultsWriter& writer, std::size_t place, const std::string& id) {
    writer.append(place, sample_trial(id), sample_times(id));
  }
  void add_text(const fs::path& file, const std::string& text) {
    std::ofstream(folder_ / file, std::ios::app | std::ios::binary) << text;
  }
  std::string bytes(const fs::path& file) { return read_file(folder_ / file); }
  std::vector<std::string> trials() {
    std::vector<std::string> ids;
    for (const TrialRecord& record : read_trials(folder_)) ids.push_back(record.trial);
    return ids;
  }
  fs::path folder_;
};

TEST_F(ResultsFolderTest, WritesAndReadsTrials) {
  ResultsWriter writer(folder_);
  writer.write_manifest({});
  add(writer, 0, "aa");
  add(writer, 1000, "bb");
  EXPECT_TRUE(fs::exists(folder_ / "trials" / "0001.jsonl"));
  const auto read = read_trials(folder_);
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(to_lines(read[1]), to_lines(sample_trial("bb")));
  EXPECT_THAT(writer.finished_trials(), ElementsAre("aa", "bb"));
  EXPECT_EQ(writer.finished().at("aa").plugins.algorithm, "c3");
  ASSERT_EQ(read_times(folder_).size(), 2U);
  EXPECT_EQ(read_times(folder_)[1].trial, "bb");
}

TEST_F(ResultsFolderTest, AppendsFromSeveralThreads) {
  ResultsWriter writer(folder_);
  writer.write_manifest({});
  std::vector<std::thread> threads;
  for (int thread = 0; thread < 4; ++thread)
    threads.emplace_back([&writer, thread] {
      for (int number = 0; number < 25; ++number)
        add(writer, static_cast<std::size_t>(number), std::to_string(thread) + "-" + std::to_string(number));
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(trials().size(), 100U);
}

// Cut within the second trial's block: the first trial stays whole, the second does not count, and running it again
// gives the bytes of a run that was never cut.
TEST_F(ResultsFolderTest, CutsHalfWrittenTails) {
  std::string whole;
  {
    ResultsWriter writer(folder_);
    writer.write_manifest({});
    add(writer, 0, "aa");
    whole = bytes("trials/0000.jsonl");
    add(writer, 1, "bb");
  }
  const std::string both = bytes("trials/0000.jsonl");
  const std::string both_times = bytes("times/0000.jsonl");
  for (std::size_t size = whole.size() + 1; size < both.size(); size += 97) {
    write_file_atomically(folder_ / "trials/0000.jsonl", both.substr(0, size));
    EXPECT_THAT(trials(), ElementsAre("aa"));
    ResultsWriter writer(folder_);
    EXPECT_EQ(writer.repaired(), 1U);
    EXPECT_THAT(writer.finished_trials(), ElementsAre("aa"));
    EXPECT_EQ(bytes("trials/0000.jsonl"), whole);
    add(writer, 1, "bb");
    writer.finish({"aa", "bb"});
    EXPECT_EQ(bytes("trials/0000.jsonl"), both);
    EXPECT_EQ(bytes("times/0000.jsonl"), both_times);
  }
  // The last byte is the newline: without it the block is not known to be whole.
  write_file_atomically(folder_ / "trials/0000.jsonl", both.substr(0, both.size() - 1));
  EXPECT_THAT(ResultsWriter(folder_).finished_trials(), ElementsAre("aa"));
}

TEST_F(ResultsFolderTest, ReaderNamesIncompleteTrials) {
  {
    ResultsWriter writer(folder_);
    writer.write_manifest({});
    add(writer, 0, "aa");
  }
  add_text("trials/0000.jsonl", to_lines(sample_trial("bb")).substr(0, 700));
  std::vector<std::string> incomplete;
  EXPECT_EQ(read_trials(folder_, [&](const std::string& trial) { incomplete.push_back(trial); }).size(), 1U);
  EXPECT_THAT(incomplete, ElementsAre("bb"));
}

TEST_F(ResultsFolderTest, ReportsDamageInTheMiddleWithItsLine) {
  {
    ResultsWriter writer(folder_);
    writer.write_manifest({});
    add(writer, 0, "aa");
  }
  add_text("trials/0000.jsonl", "what is this\n" + with_checksum(to_lines(sample_trial("bb"))) + "\n");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_trials(folder_); }), HasSubstr("0000.jsonl:5"));
  // A step line that got lost.
  std::string lines = to_lines(sample_trial("aa")) + "\n";
  lines.erase(lines.find('\n') + 1, lines.find('\n', lines.find('\n') + 1) - lines.find('\n'));
  write_file_atomically(folder_ / "trials/0000.jsonl", lines);
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_trials(folder_); }),
              HasSubstr("trial aa is damaged: it has 2 step lines, but its closing line counts 3"));
}

TEST_F(ResultsFolderTest, FinishSortsByThePlan) {
  const std::vector<std::string> order = {"aa", "bb", "cc", "dd"};
  {
    ResultsWriter writer(folder_ / "one");
    writer.write_manifest({});
    for (const std::size_t place : {0U, 1U, 2U}) add(writer, place, order[place]);
    writer.finish(order);
  }
  {
    ResultsWriter writer(folder_ / "two");
    writer.write_manifest({});
    add(writer, 2000, "zz");  // of an earlier form of the suite
    for (const std::size_t place : {2U, 0U, 1U}) add(writer, place, order[place]);
    writer.finish(order);
    const std::string sorted = bytes("two/trials/0000.jsonl");
    EXPECT_EQ(sorted.substr(0, bytes("one/trials/0000.jsonl").size()), bytes("one/trials/0000.jsonl"));
    EXPECT_THAT(writer.finished_trials(), ElementsAre("aa", "bb", "cc", "zz"));
    writer.drop({"zz"});
    writer.finish(order);
  }
  EXPECT_EQ(bytes("one/trials/0000.jsonl"), bytes("two/trials/0000.jsonl"));
  EXPECT_EQ(bytes("one/times/0000.jsonl"), bytes("two/times/0000.jsonl"));
  for (const char* name : {"trials.new", "trials.old", "times.new", "times.old", ".lock"})
    EXPECT_FALSE(fs::exists(folder_ / "two" / name)) << name;
}

TEST_F(ResultsFolderTest, RecoversFromCrashDuringFinish) {
  {
    ResultsWriter writer(folder_);
    writer.write_manifest({});
    add(writer, 0, "aa");
  }
  const std::string before = bytes("trials/0000.jsonl");
  // Between the two moves.
  fs::rename(folder_ / "trials", folder_ / "trials.old");
  fs::create_directories(folder_ / "trials.new");
  write_file_atomically(folder_ / "trials.new/0000.jsonl", before);
  EXPECT_THAT(error_text(ErrorKind::bad_input, [this] { read_trials(folder_); }), HasSubstr("resume that run first"));
  EXPECT_THAT(ResultsWriter(folder_).finished_trials(), ElementsAre("aa"));
  // Before them: trials.new may be half done.
  fs::create_directories(folder_ / "trials.new");
  EXPECT_THAT(ResultsWriter(folder_).finished_trials(), ElementsAre("aa"));
  EXPECT_FALSE(fs::exists(folder_ / "trials.new"));
  EXPECT_FALSE(fs::exists(folder_ / "trials.old"));
}

// Both would be read as file 0, one for the list of trials and the other for their steps.
TEST_F(ResultsFolderTest, RefusesAnotherNameOfTheSameNumber) {
  {
    ResultsWriter writer(folder_);
    writer.write_manifest({});
    add(writer, 0, "aa");
  }
  fs::rename(folder_ / "trials/0000.jsonl", folder_ / "trials/00000.jsonl");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [this] { read_trials(folder_); }),
              HasSubstr("00000.jsonl' is not a file of records; expected the name '0000.jsonl'"));
}

TEST_F(ResultsFolderTest, DropsTrialsThatCanBeAppendedAgain) {
  ResultsWriter writer(folder_);
  writer.write_manifest({});
  for (const char* id : {"aa", "bb", "cc"}) add(writer, 0, id);
  writer.drop({"aa", "cc"});
  EXPECT_THAT(trials(), ElementsAre("bb"));
  EXPECT_THAT(writer.finished_trials(), ElementsAre("bb"));
  EXPECT_EQ(read_times(folder_).size(), 1U);
  add(writer, 0, "aa");
  EXPECT_THAT(trials(), ElementsAre("bb", "aa"));
}

TEST_F(ResultsFolderTest, ReadsPlannedTrialsInManifestOrder) {
  ResultsWriter writer(folder_);
  for (const char* id : {"aa", "bb", "cc"}) add(writer, 0, id);
  writer.write_manifest(made_manifest({{"order", {"cc", "missing", "aa"}}}));
  std::vector<std::string> ids;
  for (const TrialRecord& record : read_planned_trials(folder_)) ids.push_back(record.trial);
  EXPECT_THAT(ids, ElementsAre("cc", "aa"));
}

TEST_F(ResultsFolderTest, RejectsSecondWriter) {
  {
    ResultsWriter writer(folder_);
    writer.write_manifest({});
    EXPECT_THAT(error_text(ErrorKind::io, [&] { ResultsWriter second(folder_); }), HasSubstr("another run is writing"));
    add(writer, 0, "aa");
  }
  ResultsWriter after(folder_);
  EXPECT_THAT(after.finished_trials(), ElementsAre("aa"));
}

TEST_F(ResultsFolderTest, RejectsForeignFolders) {
  write_file_atomically(folder_ / "thesis.tex", "years of work");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { ResultsWriter writer(folder_); }),
              testing::AllOf(HasSubstr("is not a results folder"), HasSubstr("thesis.tex")));
  EXPECT_FALSE(fs::exists(folder_ / "trials"));
  // The manifest.json of another program.
  write_file_atomically(folder_ / "manifest.json", "{\"name\": \"web page\"}");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { ResultsWriter writer(folder_); }), HasSubstr("has no \"format\""));
  write_file_atomically(folder_ / "manifest.json", "{\"form");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { ResultsWriter writer(folder_); }), HasSubstr("damaged"));
}

TEST_F(ResultsFolderTest, NewerFormatsAreRefused) {
  write_file_atomically(folder_ / "manifest.json", "{\"format\": 2}");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { ResultsWriter writer(folder_); }), HasSubstr("newer"));
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_trials(folder_); }), HasSubstr("newer"));
  EXPECT_FALSE(fs::exists(folder_ / "trials"));
}

TEST_F(ResultsFolderTest, NamesFoldersThatCannotBeWritten) {
  write_file_atomically(folder_ / "file", "");
  EXPECT_THAT(error_text(ErrorKind::io, [&] { ResultsWriter writer(folder_ / "file"); }), HasSubstr("file"));
  EXPECT_THAT(error_text(ErrorKind::io, [&] { ResultsWriter writer(folder_ / "file" / "below"); }), HasSubstr("below"));
  // A file system that not even root can write.
  EXPECT_THAT(error_text(ErrorKind::io, [] { ResultsWriter writer("/proc/relign-results"); }),
              HasSubstr("/proc/relign-results"));
  EXPECT_THAT(error_text(ErrorKind::io, [&] { read_trials(folder_ / "missing"); }), HasSubstr("no such folder"));
  EXPECT_THAT(error_text(ErrorKind::io, [&] { read_trials(folder_ / "file"); }),
              HasSubstr("it is a file; expected a folder"));
}

// A limit on file size acts like a full disk: the write stops in the middle of a block.
TEST_F(ResultsFolderTest, FullDiskLeavesNoHalfTrial) {
  ResultsWriter writer(folder_);
  writer.write_manifest({});
  add(writer, 0, "aa");
  const std::string before = bytes("trials/0000.jsonl");
  const std::string times_before = bytes("times/0000.jsonl");
  rlimit old{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old), 0);
  void (*old_handler)(int) = std::signal(SIGXFSZ, SIG_IGN);
  rlimit low = old;
  low.rlim_cur = before.size() + 500;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &low), 0);
  const std::string message = error_text(ErrorKind::io, [&] { add(writer, 1, "bb"); });
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &old), 0);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_THAT(message, HasSubstr("cannot write"));
  EXPECT_EQ(bytes("trials/0000.jsonl"), before);
  EXPECT_EQ(bytes("times/0000.jsonl"), times_before);
  EXPECT_THAT(writer.finished_trials(), ElementsAre("aa"));
  add(writer, 1, "bb");  // space again
  EXPECT_THAT(trials(), ElementsAre("aa", "bb"));
}

// Writes to a device that is always full.
TEST_F(ResultsFolderTest, ReportsFullDevice) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  ResultsWriter writer(folder_);
  fs::create_symlink("/dev/full", folder_ / "times" / "0000.jsonl");
  EXPECT_THAT(error_text(ErrorKind::io, [&] { add(writer, 0, "aa"); }), HasSubstr("No space left"));
  EXPECT_TRUE(writer.finished_trials().empty());
  fs::remove(folder_ / "times" / "0000.jsonl");
}

TEST_F(ResultsFolderTest, RejectsStudiesPublishedWithoutTrials) {
  {
    ResultsWriter writer(folder_);
    writer.write_manifest({});
  }
  EXPECT_THAT(read_trials(folder_), IsEmpty());
  fs::remove_all(folder_ / "trials");
  EXPECT_THAT(read_trials(folder_), IsEmpty()) << "nothing to lose";
  write_file_atomically(folder_ / "instances.csv", "trial\n");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_trials(folder_); }),
              HasSubstr("was published without its raw trials"));
}

}  // namespace
}  // namespace relign::records
