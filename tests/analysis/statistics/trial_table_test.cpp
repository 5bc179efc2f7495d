#include "statistics/trial_table.h"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "base/files.h"
#include "error_text.h"
#include "records/checksum.h"
#include "records/sample_records.h"
#include "resealed.h"
#include "statistics/made_table.h"

namespace relign::statistics {
namespace {

using records::sample_times;
using records::sample_trial;
using test::error_text;
using testing::ElementsAre;
using testing::HasSubstr;

using Table = MadeTable;

TEST_F(Table, ReadsTheFieldsOfATrial) {
  records::TrialRecord trial = sample_trial("a", 2);
  trial.steps[2].recommended_seconds = 0.5;
  trial.warnings = {"look", "look", "again"};
  records::TrialTimes times = sample_times("a", 2);
  times.harness_seconds = 0.125;
  const TrialTable made = table({trial}, {times});
  ASSERT_EQ(made.rows.size(), 1U);
  const TrialRow& row = made.rows[0];
  EXPECT_EQ(row.trial, "a");
  EXPECT_EQ(row.instance, 7U);
  EXPECT_EQ(made.text(row.end), "budget_spent");
  EXPECT_EQ(made.text(row.message), "");
  EXPECT_EQ(made.text(row.recommendation), "own");
  EXPECT_EQ(row.budget, 2U);
  EXPECT_EQ(row.steps, 3U);
  EXPECT_EQ(row.last_step, 2U);
  EXPECT_TRUE(row.counts());
  EXPECT_TRUE(std::isnan(row.own_optimum_mse));
  EXPECT_EQ(row.start_measured, 0.04);
  EXPECT_EQ(row.start_commanded, 0.01);
  EXPECT_EQ(row.last_of(Track::best), 0.04 / 3);
  EXPECT_TRUE(std::isnan(row.last_of(Track::excess)));
  EXPECT_EQ(row.machine_seconds(), 0.2);
  EXPECT_EQ(row.recommended_seconds(), 0.5);
  EXPECT_EQ(row.algorithm_ms_per_step, 375) << "three quarters of a second over two steps";
  EXPECT_EQ(made.harness_seconds, 0.125);
  EXPECT_EQ(made.scene_seconds, 4.5) << "1.5 s of captures, 3 s of truth";
  EXPECT_EQ(made.timed_steps, 3U);
  ASSERT_EQ(made.warnings.size(), 2U);
  EXPECT_EQ(made.text(made.warnings[0].warning.text), "look");
  EXPECT_EQ(made.warnings[0].count, 2U);
}

TEST_F(Table, GroupsTrialsIntoSeries) {
  records::TrialRecord failed = sample_trial("b"), other = sample_trial("c"), early = sample_trial("d", 0);
  failed.end = "crashed(SIGSEGV)";
  failed.message = "no";
  other.algorithm = "jumper";
  early.steps.clear();
  early.end = "finished";
  const TrialTable made = table({sample_trial("a"), failed, other, early, sample_trial("e", 5)});
  ASSERT_EQ(made.series.size(), 2U);
  EXPECT_THAT(made.series[0].trials, ElementsAre(0, 4));
  EXPECT_EQ(made.series[0].failed, 2U) << "a trial without steps counts as failed";
  EXPECT_EQ(made.series[0].largest_budget, 5U);
  EXPECT_EQ(made.series_of(made.rows[2]).algorithm, "jumper");
  EXPECT_EQ(made.text(made.rows[1].message), "no");
}

TEST_F(Table, KeepsWantedTrialsAndFirstRecords) {
  records::TrialRecord again = sample_trial("a");
  again.instance = 99;
  table({sample_trial("a"), sample_trial("b"), sample_trial("c")});
  std::ofstream(folder_ / "trials" / "0000.jsonl", std::ios::app) << records::with_checksum(to_lines(again)) << "\n"
                                                                  << step_line("b", again.steps[0]) << "\n"
                                                                  << step_line("d", again.steps[0]) << "\n";
  const ReadTable read = read_trial_table(folder_, [](const std::string& trial) { return trial != "c"; });
  ASSERT_EQ(read.table.rows.size(), 2U);
  EXPECT_EQ(read.table.rows[0].instance, 7U);
  EXPECT_EQ(read.left_out, 1U);
  EXPECT_THAT(read.incomplete, ElementsAre("d")) << "b has a complete record as well";
}

// Members in another order and extra spaces, as from other JSON writers.
TEST_F(Table, ReadsReorderedMembers) {
  const TrialTable before = table({sample_trial("a")});
  std::string text, line;
  std::ifstream stream(folder_ / "trials" / "0000.jsonl");
  while (std::getline(stream, line))
    if (Json step = Json::parse(line); !step.contains("end")) {  // starts with its trial; all else sorted by name
      step.erase("trial");
      text += "{\"trial\":\"a\", " + step.dump().substr(1) + "\n";
    } else {
      text += line + "\n";
    }
  write_file_atomically(folder_ / "trials" / "0000.jsonl", records::resealed(text));
  const TrialTable after = read_trial_table(folder_).table;
  ASSERT_EQ(after.rows.size(), 1U);
  EXPECT_EQ(after.rows[0].last_of(Track::recommended), before.rows[0].last_of(Track::recommended));
  EXPECT_EQ(after.rows[0].machine_seconds(), before.rows[0].machine_seconds());
}

TEST_F(Table, NamesTheDamagedLine) {
  table({sample_trial("a")});
  std::string text = read_file(folder_ / "trials" / "0000.jsonl");
  text.replace(text.find("\"measured\":"), 13, "\"measured\":x");
  write_file_atomically(folder_ / "trials" / "0000.jsonl", text);
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_trial_table(folder_); }),
              HasSubstr("0000.jsonl:4: trial a is damaged"));
}

TEST_F(Table, NamesTheLineThatWasEditedTogetherWithItsChecksum) {
  table({sample_trial("a")});
  std::string text = read_file(folder_ / "trials" / "0000.jsonl");
  const std::size_t second = text.find('\n') + 1;
  text.replace(text.find("\"measured\":", second), 13, "\"measured\":x");
  write_file_atomically(folder_ / "trials" / "0000.jsonl", records::resealed(text));
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_trial_table(folder_); }), HasSubstr("0000.jsonl:2"));
}

}  // namespace
}  // namespace relign::statistics
