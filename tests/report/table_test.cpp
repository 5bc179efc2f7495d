#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "base/files.h"
#include "report/escape.h"
#include "report/made_results.h"
#include "report/report.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

const fs::path kGolden = fs::path(RELIGN_TEST_DATA) / "report";

TEST(RankingTable, MatchesTheApprovedOne) {
  EXPECT_EQ(ranking_table(kGolden / "small"), read_file(kGolden / "ranking.txt"));
}

using RankingTableOf = MadeResults;

TEST_F(RankingTableOf, AnEmptyFolderIsASentence) {
  write({}, "made", 3);
  EXPECT_EQ(ranking_table(folder_), "0 of 3 trials finished: nothing to rank yet.\n");
}

TEST_F(RankingTableOf, StaysWithinNinetyColumnsAndMovesNoCursor) {
  std::vector<records::TrialRecord> trials = {trial(kHostile, 0, {0.1, 0.000012345}, kHostile),
                                              trial(std::string(200, 'w'), 0, {0.1, 0.05}, kHostile),
                                              trial("short", 0, {0.1, 0.05, 0.04}, kHostile)};
  trials.push_back(trial(kHostile, 1, {0.1, 0.000022345}, kHostile));
  write(trials);
  const std::string table = ranking_table(folder_);
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(columns(line), 90u) << line;
  EXPECT_THAT(table, Not(HasSubstr("\x1b")));
  EXPECT_THAT(table, HasSubstr("steps")) << "budgets differ, so they have a column";
}

}  // namespace
}  // namespace relign::report
