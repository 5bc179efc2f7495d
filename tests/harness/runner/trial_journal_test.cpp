#include "runner/trial_journal.h"

#include <gmock/gmock.h>
#include <sys/mman.h>
#include <unistd.h>

#include <limits>

namespace relign::runner {
namespace {

using testing::ElementsAre;

class TrialJournalTest : public testing::Test {
 protected:
  TrialJournalTest() : file_(::memfd_create("journal", MFD_CLOEXEC)) {}
  ~TrialJournalTest() override { ::close(file_); }

  static records::StepRecord step(unsigned number) {
    records::StepRecord record;
    record.step = number;
    record.commanded_pose = {0.1 * number};
    record.true_pose = {std::numeric_limits<double>::quiet_NaN()};
    record.recommended_pose = record.recommended_true_pose = {0.5};
    record.recommendation = "own";
    return record;
  }

  void append(const std::string& text) {
    ASSERT_GE(::pwrite(file_, text.data(), text.size(), ::lseek(file_, 0, SEEK_END)), 0);
  }

  int file_;
};

TEST_F(TrialJournalTest, RoundTrips) {
  JournalWriter writer(file_);
  writer.begin();
  writer.add_log("first\nsecond \\n, not a line end\n");
  writer.add_step("aa", step(0), 0.1, 0.2, 0.3);
  writer.add_log("\xff no UTF-8\n");
  writer.add_step("aa", step(1), 1e-9, 0, 7);
  for (const bool checked : {false, true}) {
    const Journal journal = read_journal(file_, "aa", checked);
    EXPECT_EQ(journal.step_lines, records::step_line("aa", step(0)) + "\n" + records::step_line("aa", step(1)) + "\n");
    EXPECT_EQ(journal.steps, 2U);
    EXPECT_EQ(journal.log, "first\nsecond \\n, not a line end\n\xff no UTF-8\n");
    EXPECT_THAT(journal.times.algorithm_seconds, ElementsAre(0.1, 1e-9));
    EXPECT_THAT(journal.times.simulation_seconds, ElementsAre(0.2, 0));
    EXPECT_THAT(journal.times.truth_seconds, ElementsAre(0.3, 7));
    EXPECT_EQ(journal.size, writer.size());
    EXPECT_EQ(journal.digest, writer.digest());
  }
}

TEST_F(TrialJournalTest, ReadsUpToTheLastCompleteStep) {
  JournalWriter writer(file_);
  writer.begin();
  writer.add_step("aa", step(0), 1, 1, 1);
  const std::string line = "S" + records::step_line("aa", step(1)) + "\n";
  append(line);  // its times are missing
  append(line.substr(0, line.size() / 2));
  const Journal journal = read_journal(file_, "aa", true);
  EXPECT_EQ(journal.steps, 2U);
  EXPECT_THAT(journal.times.truth_seconds, ElementsAre(1, 0));
  EXPECT_NE(journal.digest, writer.digest());
}

TEST_F(TrialJournalTest, StopsAtMalformedEntries) {
  const std::string good = "S" + records::step_line("aa", step(0)) + "\nT[1,1,1]\n";
  const std::vector<std::string> all = {"S{}\n",
                                        "\n",
                                        "nonsense\n",
                                        "T[1]\n",
                                        "T[\"a\",1,1]\n",
                                        "S\n",
                                        "S" + records::step_line("bb", step(1)) + "\n",   // of another trial
                                        "S" + records::step_line("aa", step(5)) + "\n"};  // out of turn
  for (const std::string& malformed : all) {
    clear_journal(file_);
    append(good);
    append(malformed);
    append("S" + records::step_line("aa", step(1)) + "\nT[1,1,1]\n");
    EXPECT_EQ(read_journal(file_, "aa", true).steps, 1U) << malformed;
  }
  clear_journal(file_);
  EXPECT_EQ(read_journal(file_, "aa", true).size, 0U);
}

}  // namespace
}  // namespace relign::runner
