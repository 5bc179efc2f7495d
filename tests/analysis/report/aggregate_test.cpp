// The aggregates on the page, in Markdown and in aggregate.csv. Their numbers are tested in tests/analysis/statistics
// and by test_recompute.py.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "report/aggregate_data.h"
#include "report/figures.h"
#include "report/made_results.h"
#include "report/report.h"
#include "report/written.h"

namespace relign::report {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

class AggregateReport : public MadeResults {
 protected:
  static records::TrialRecord known(records::TrialRecord record) {
    record.own_optimum.mse = 0;
    return record;
  }
  static records::TrialRecord trained(const std::string& training, std::uint64_t instance, double error,
                                      const std::string& level) {
    records::TrialRecord record = known(trial("net (" + training + ")", instance, {0.1, error}, level));
    record.method = "net";
    record.training = training;
    return record;
  }

  // A search with error 1/3, a method with two trainings at 0 and 2/3, and a single model that fails once.
  void write_study() {
    std::vector<records::TrialRecord> trials;
    for (const char* level : {"rho0", "rho0.5"})
      for (std::uint64_t i = 0; i < 4; ++i) {
        trials.push_back(known(trial("search", i, {0.1, 0.001}, level)));
        trials.push_back(trained("one", i, 0.0001, level));
        trials.push_back(trained("two", i, 0.01, level));
        trials.push_back(known(trial("lone", i, {0.1, 0.1}, level)));
        if (i == 2) trials.back().end = "timeout";
      }
    write(trials);
    const Json cost = {{"hours", 1.0}, {"steps", 10}, {"machine", ""}};
    Json algorithms = {{{"name", "search"}, {"observes", {"merit"}}},
                       {{"name", "lone"}, {"observes", {"images"}}, {"training", cost}}};
    for (const char* training : {"one", "two"}) {
      algorithms.push_back({{"name", std::string("net (") + training + ")"},
                            {"observes", {"images"}},
                            {"training", cost},
                            {"of_list", {{"method", "net"}, {"training", training}}}});
    }
    add_to_manifest({{"algorithms", algorithms}});
  }
  PageModel data() { return page_model(load_results(folder_)); }
};

TEST_F(AggregateReport, PrecedesTheRankingWithEachMethodOnce) {
  write_study();
  const std::string page = Report(folder_).html();
  const std::size_t verdict = page.find("<h2>Verdict"),
                    aggregate = page.find("<h2>Aggregate over all scenes and noise levels"),
                    ranking = page.find("<h2>Ranking");
  ASSERT_NE(aggregate, std::string::npos);
  EXPECT_LT(verdict, aggregate);
  EXPECT_LT(aggregate, ranking);
  const std::string section = written(aggregate_section, data());
  for (const char* words : {"2 strata", "4 instances each", "2 training runs", "one training run", "optimality gap",
                            "IQM of 2 training runs 0 to 0.667", " better)", "Probability of improvement"})
    EXPECT_THAT(section, HasSubstr(words)) << words;
  EXPECT_LT(section.find("search"), section.find("lone"));
}

TEST_F(AggregateReport, MarksTrainedMethodsInAllTables) {
  write_study();
  const Report report(folder_);
  EXPECT_EQ(training_tag(report.model().methods, "lone"), "one training run");
  EXPECT_EQ(training_tag(report.model().methods, "net (two)"), "1 of 2 training runs");
  EXPECT_EQ(training_tag(report.model().methods, "search"), "");
  EXPECT_THAT(report.ranking_table(), HasSubstr("lone *"));
  EXPECT_THAT(report.ranking_table(), Not(HasSubstr("search *")));
  EXPECT_THAT(report.ranking_table(), HasSubstr("* one training run"));
  EXPECT_THAT(report.markdown(), HasSubstr("| lone (one training run) |"));
  for (const auto section : {ranking_section, matrix_section, pairs_section, training_section, methods_section})
    EXPECT_THAT(written(section, report.model()), HasSubstr("one training run"));
}

TEST_F(AggregateReport, MarkdownMatchesCsv) {
  write_study();
  const PageModel all = data();
  const std::string markdown = aggregate_markdown(all), csv = aggregate_csv(all);
  EXPECT_THAT(markdown, HasSubstr("| net (2 training runs) | images | 0.333"));
  EXPECT_THAT(markdown, HasSubstr("net: IQM of 2 training runs 0 to 0.667, standard deviation 0.47."));
  EXPECT_THAT(markdown, HasSubstr("| lone (one training run) | images | 1.00 (1.00 - 1.00) |"));
  EXPECT_THAT(
      csv, StartsWith("protocol,algorithm,training,class,oracle,trainings,trained,strata,n,failed,steps,iqm,iqm_lo95"));
  EXPECT_THAT(csv, HasSubstr("\npaper,net,,images,false,2,true,2,16,0,1,"));
  EXPECT_THAT(csv, HasSubstr("\npaper,net,two,images,false,1,true,2,8,0,1,0.6666666667,"));
  EXPECT_THAT(csv, HasSubstr("\npaper,lone,,images,false,1,true,2,8,2,1,1,1,1,"));
  EXPECT_THAT(csv, HasSubstr("\npaper,search,,merit,false,1,false,2,8,0,1,"));
  Report(folder_).write_tables();
  EXPECT_EQ(read_file(folder_ / "aggregate.csv"), csv);
}

TEST_F(AggregateReport, HasProfileAndConvergenceFigures) {
  write_study();
  std::vector<std::string> names;
  for (const Figure& figure : aggregate_figures(data(), 0)) {
    names.push_back(figure.name);
    EXPECT_EQ(figure.chart.series.size(), 3u) << "search, net, lone";
    std::set<int> styles;
    for (const ChartSeries& series : figure.chart.series) styles.insert(series.style);
    EXPECT_EQ(styles.size(), 3u) << "one colour for each method";
  }
  EXPECT_THAT(names, ElementsAre("profile-1-paper", "progress-1-paper"));
}

TEST_F(AggregateReport, NeedsGroundTruth) {
  write({trial("a", 0, {0.1, 0.01}), trial("b", 0, {0.1, 0.02})});
  const PageModel all = data();
  EXPECT_TRUE(all.aggregates.empty());
  EXPECT_THAT(written(aggregate_section, all), IsEmpty());
  EXPECT_THAT(aggregate_markdown(all), IsEmpty());
  const std::string csv = aggregate_csv(all);
  EXPECT_EQ(csv.find('\n'), csv.size() - 1) << "only the header";
}

}  // namespace
}  // namespace relign::report
