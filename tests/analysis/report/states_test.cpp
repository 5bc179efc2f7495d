// Pages of results folders in different states: complete, partial, failed, empty.
#include <gmock/gmock.h>

#include "report/made_results.h"
#include "report/page_json.h"
#include "report/report.h"

namespace relign::report {
namespace {

using testing::HasSubstr;
using testing::Not;

class States : public MadeResults {
 protected:
  // `methods` methods on `instances` instances, the first is the best.
  std::vector<records::TrialRecord> trials(std::size_t methods, std::uint64_t instances) {
    std::vector<records::TrialRecord> made;
    for (std::size_t m = 0; m < methods; ++m)
      for (std::uint64_t i = 0; i < instances; ++i) {
        const double last = 0.01 * static_cast<double>(m + 1) + 0.001 * static_cast<double>((i * 7 + m) % 5);
        made.push_back(trial("method " + std::to_string(m), i, {0.9, 0.5 + last, last}));
      }
    return made;
  }
  std::string html() { return Report(folder_).html(); }
  Json group() { return to_json(page_model(load_results(folder_)))["groups"][0]; }
};

TEST_F(States, CompleteResultsHaveStatistics) {
  write(trials(2, 8));
  const Json whole = group();
  EXPECT_EQ(whole["pairs"].size(), 1U);
  EXPECT_TRUE(whole["rows"][0]["recommended"]["lo95"].is_number());
  const std::string page = html();
  for (const char* words : {"All planned trials finished (16 of 16)", "Pairwise comparisons",
                            "Runtime distribution (ECDF)", "95 % intervals (CI) are bootstrap"})
    EXPECT_THAT(page, HasSubstr(words)) << words;
  EXPECT_THAT(page, Not(HasSubstr("do not rely on these results")));
}

// A killed run: some trials did not start, one was interrupted.
TEST_F(States, PartialResultsWarnBeforeTheVerdict) {
  write(trials(2, 6), "made", 4);
  const std::filesystem::path file = folder_ / "trials/0000.jsonl";
  std::string lines = read_file(file), step = lines.substr(0, lines.find('\n') + 1);
  const std::string id = short_id("rho0method 00");
  ASSERT_NE(step.find(id), std::string::npos);
  lines += step.replace(step.find(id), id.size(), "never-run-0");
  write_file_atomically(file, lines);
  const std::string page = html();
  for (const char* words : {"12/16 trials ran", "4 trials not finished", "Only 12/16 trials have ended",
                            "do not rely on these results", "4 have no result", "Run the same command again to resume"})
    EXPECT_THAT(page, HasSubstr(words)) << words;
  EXPECT_LT(page.find("do not rely on these results"), page.find("<h2>Verdict"));
  EXPECT_THAT(page, HasSubstr("Pairwise comparisons")) << "available results are shown";
}

TEST_F(States, IfAllTrialsFailedNothingIsRanked) {
  std::vector<records::TrialRecord> failed = trials(2, 3);
  for (records::TrialRecord& one : failed) one.end = "crashed(SIGSEGV)", one.message = "it fell";
  write(failed);
  const std::string page = html();
  for (const char* words :
       {"every trial failed; nothing can be ranked", "3 failed: method 0", "it fell", "100 % of the trials failed"})
    EXPECT_THAT(page, HasSubstr(words)) << words;
  EXPECT_THAT(page, Not(HasSubstr("Pairwise comparisons")));
}

TEST_F(States, OneInstanceHasNoIntervalAndNoComparison) {
  write(trials(3, 1));
  const Json one = group();
  EXPECT_FALSE(one["rows"][0]["recommended"]["lo95"].is_number());
  const std::string page = html();
  EXPECT_THAT(page, HasSubstr("on a single instance"));
  EXPECT_THAT(page, HasSubstr("Results on a single instance do not generalise to other instances."));
  EXPECT_THAT(page, Not(HasSubstr("95 % intervals (CI) are bootstrap")));
  EXPECT_THAT(page, Not(HasSubstr("is better: paired")));
}

TEST_F(States, OneMethodHasNoComparison) {
  write(trials(1, 8));
  EXPECT_FALSE(group().contains("pairs"));
  const std::string page = html();
  EXPECT_THAT(page, HasSubstr("No other method has a result."));
  EXPECT_THAT(page, HasSubstr("Runtime distribution (ECDF)"));
  EXPECT_THAT(page, Not(HasSubstr("Pairwise comparisons")));
}

TEST_F(States, EmptyResultsAreReported) {
  write({});
  const std::string page = html();
  EXPECT_THAT(page, HasSubstr("This results folder contains no trials"));
  EXPECT_THAT(page, HasSubstr("No trials were planned or run."));
  EXPECT_THAT(page, Not(HasSubstr("<h2>Verdict")));
  EXPECT_THAT(Report(folder_).write_figures(folder_ / "paper"), testing::IsEmpty());
}

TEST_F(States, FortyMethodsAreInAllTablesAndFigures) {
  write(trials(40, 8));
  const std::string page = html();
  for (const char* name : {"method 0<", "method 17<", "method 39<"}) EXPECT_THAT(page, HasSubstr(name));
  EXPECT_EQ(group()["rows"].size(), 40U);
  EXPECT_EQ(group()["pairs"].size(), 39U) << "the best with every other";
  EXPECT_LT(page.size(), 1'500'000U);
  const auto files = Report(folder_).write_figures(folder_ / "paper");
  const std::string curves = read_file(folder_ / "paper/curves-1-rho0.csv");
  for (int method = 0; method < 40; ++method)
    EXPECT_THAT(curves, HasSubstr("\nmethod " + std::to_string(method) + ",")) << method;
}

}  // namespace
}  // namespace relign::report
