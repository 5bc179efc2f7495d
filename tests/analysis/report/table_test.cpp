#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "base/files.h"
#include "markup/escape.h"
#include "report/made_results.h"
#include "report/report.h"

namespace relign::report::table_tests {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const fs::path kGolden = fs::path(RELIGN_TEST_DATA) / "report";

TEST(RankingTable, MatchesTheApprovedOne) {
  EXPECT_EQ(Report(kGolden / "small").ranking_table(), read_file(kGolden / "ranking.txt"));
}

using RankingTableOf = MadeResults;

TEST_F(RankingTableOf, AnEmptyFolderIsOneLine) {
  write({}, "made", 3);
  EXPECT_EQ(Report(folder_).ranking_table(), "0 of 3 trials finished, nothing to rank yet.\n");
}

TEST_F(RankingTableOf, FitsNinetyColumnsWithoutControlCharacters) {
  std::vector<records::TrialRecord> trials = {trial(kHostile, 0, {0.1, 0.000012345}, kHostile),
                                              trial(std::string(200, 'w'), 0, {0.1, 0.05}, kHostile),
                                              trial("short", 0, {0.1, 0.05, 0.04}, kHostile)};
  trials.push_back(trial(kHostile, 1, {0.1, 0.000022345}, kHostile));
  write(trials);
  const std::string table = Report(folder_).ranking_table();
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(columns(line), 90u) << line;
  EXPECT_THAT(table, Not(HasSubstr("\x1b")));
  EXPECT_THAT(table, HasSubstr("steps")) << "budgets differ, so there is a column for them";
}

TEST_F(RankingTableOf, ShowsTheYieldWithASpecification) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 4; ++i) trials.push_back(trial("a", i, {0.1, i < 3 ? 0.01 : 0.05}));
  write(trials);
  EXPECT_THAT(Report(folder_).ranking_table(), Not(HasSubstr("in spec")));
  add_to_manifest({{"spec", {{"rmse", 0.02}}}});
  EXPECT_THAT(Report(folder_).ranking_table(),
              AllOf(HasSubstr("in spec"), HasSubstr("75 %"), HasSubstr("spec: RMSE 0.0200")));
  EXPECT_THAT(Report(folder_).markdown(), HasSubstr(", 75 % in spec |"));
}

TEST_F(RankingTableOf, WarnsOfDifferentInstances) {
  write({trial("a", 0, {0.1, 0.01}), trial("a", 1, {0.1, 0.02}), trial("b", 0, {0.1, 0.005})});
  EXPECT_THAT(Report(folder_).ranking_table(),
              AllOf(HasSubstr("  instances  "), HasSubstr("medians are over different instances")));
  write({trial("a", 0, {0.1, 0.01}), trial("b", 0, {0.1, 0.005})});
  EXPECT_THAT(Report(folder_).ranking_table(), Not(HasSubstr("different instances")));
}

TEST(MarkdownReport, MatchesTheApprovedOne) {
  EXPECT_EQ(Report(kGolden / "small").markdown(), read_file(kGolden / "ranking.md"));
}

using MarkdownReportOf = MadeResults;

TEST_F(MarkdownReportOf, AnEmptyFolderHasNoTable) {
  write({}, "made", 3);
  EXPECT_EQ(Report(folder_).markdown(),
            "**Failed checks; do not rely on these results:**\n\n* **ran**: Only 0/3 trials have ended.\n\n"
            "No trial has finished, nothing to rank yet.\n\n"
            "* Partial results: 3 of 3 trials have not finished, and all numbers below may change.\n");
}

TEST_F(MarkdownReportOf, HasTheWarningsOfThePage) {
  write({trial("a", 0, {0.1, 0.04}), trial("a", 1, {0.1, 0.02})}, "made", 2);
  const Report report(folder_);
  const std::string text = report.markdown(), page = report.html();
  EXPECT_THAT(text, HasSubstr("* **ran**: Only 2/4 trials have ended.\n"));
  EXPECT_FALSE(report.model().caveats.empty());
  for (const std::string& caveat : report.model().caveats) {
    EXPECT_THAT(text, HasSubstr("\n* " + markdown_text(caveat) + "\n"));
    EXPECT_THAT(page, HasSubstr("<li>" + html_escaped(caveat) + "</li>"));
  }
}

TEST_F(MarkdownReportOf, StatesThatTheSuiteIsMissing) {
  const auto text = [this] { return Report(folder_).markdown(); };
  const auto missing = HasSubstr("* manifest.json lacks the text of its suite, so that instances, methods");
  write({trial("a", 0, {0.1, 0.04})});
  EXPECT_THAT(text(), Not(missing));
  const Json whole = Json::parse(read_file(folder_ / "manifest.json"))["suite"];
  for (const char* suite : {"", "{}", R"({"scenes": ["relign_od"]})"}) {
    add_to_manifest({{"suite", suite}});
    EXPECT_THAT(text(), missing) << suite;
  }
  add_to_manifest({{"suite", whole}});
  EXPECT_THAT(text(), Not(missing));
  add_to_manifest({{"suite", ""}, {"suites", {{{"name", "made"}}}}});
  EXPECT_THAT(text(), missing) << "of a merged folder";
}

TEST_F(MarkdownReportOf, HasAColumnPerLevelAndTheBestFirst) {
  records::TrialRecord broken = trial("broken", 0, {0.1}, "rho0");
  broken.end = "failed";
  write({trial("worse", 0, {0.1, 0.04}, "rho0"), trial("better", 0, {0.1, 0.02}, "rho0"),
         trial("worse", 0, {0.2, 0.06}, "rho0.5"), trial("better", 0, {0.2, 0.05}, "rho0.5"), broken});
  const std::string text = Report(folder_).markdown();
  EXPECT_THAT(
      text,
      HasSubstr("steps: 1; median error at the start: 0.100, 0.200.\n\n| method | rho0 | rho0.5 | ms/step "
                "|\n|---|---|---|---:|\n"
                "| better | 0.0200 | 0.0500 | 2.0 |\n| worse | 0.0400 | 0.0600 | 2.0 |\n| broken | failed |  | - |\n"));
}

TEST_F(MarkdownReportOf, EscapesNames) {
  write({trial("a|b<i>*c*_d_", 0, {0.1, 0.05}), trial("plain_name", 0, {0.1, 0.05})});
  const std::string text = Report(folder_).markdown();
  EXPECT_THAT(text, HasSubstr("| a\\|b\\<i\\>\\*c\\*\\_d\\_ |"));
  EXPECT_THAT(text, HasSubstr("| plain_name |"));
}

}  // namespace
}  // namespace relign::report::table_tests
