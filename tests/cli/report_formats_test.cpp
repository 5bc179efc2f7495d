// report --format csv, json and md.
#include <gmock/gmock.h>

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

// Rows by column name; the tests' texts contain no commas.
std::vector<std::map<std::string, std::string>> table(const std::string& csv) {
  std::istringstream lines(csv);
  std::vector<std::vector<std::string>> rows;
  for (std::string line; std::getline(lines, line);) {
    rows.emplace_back();
    std::istringstream fields(line + ",");
    for (std::string field; std::getline(fields, field, ',');) rows.back().push_back(field);
  }
  std::vector<std::map<std::string, std::string>> named;
  for (std::size_t row = 1; row < rows.size(); ++row) {
    EXPECT_EQ(rows[row].size(), rows[0].size()) << "row " << row;
    named.emplace_back();
    for (std::size_t i = 0; i < rows[row].size(); ++i) named.back()[rows[0].at(i)] = rows[row][i];
  }
  return named;
}

// One run for all tests, and a copy of its folder.
class CliReportFormats : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    place_ = std::make_unique<Workplace>();
    json suite = json::parse(kTinySuite);
    suite["name"] = "one";
    suite["spec"] = {{"rmse", 1e-6}};
    suite["algorithms"] = {"random", "home", "breaks_down"};
    place_->write("one.json", suite.dump());
    const Outcome outcome = relign_bench(*place_, {"run", "one.json", "--plugin", RELIGN_BREAKS_DOWN});
    ASSERT_EQ(outcome.exit_code, 3) << outcome.err;
    fs::copy(place_->path("results/one"), place_->path("two"), fs::copy_options::recursive);
  }
  static void TearDownTestSuite() { place_.reset(); }
  static Outcome report(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "report");
    return relign_bench(*place_, arguments);
  }
  static std::unique_ptr<Workplace> place_;
};
std::unique_ptr<Workplace> CliReportFormats::place_;

TEST_F(CliReportFormats, CsvHasOneRowPerMethodWithTheNumbersOfJson) {
  const Outcome csv = report({"results/one", "--format", "csv"});
  ASSERT_EQ(csv.exit_code, 0) << csv.err;
  const auto rows = table(csv.out);
  ASSERT_EQ(rows.size(), 6U) << "two levels, three methods";
  const json document = json::parse(report({"results/one", "--format", "json"}).out);
  EXPECT_EQ(document.at("format"), 1);
  const json& entry = document.at("results").at(0);
  EXPECT_EQ(entry.at("folder"), "results/one");
  std::size_t at = 0;
  for (const json& group : entry.at("groups"))
    for (const json& row : group.at("rows")) {
      auto fields = rows.at(at++);
      EXPECT_EQ(fields["results"], "results/one");
      EXPECT_EQ(fields["noise_level"], group.at("noise_level"));
      EXPECT_EQ(fields["algorithm"], row.at("method"));
      EXPECT_EQ(fields["failed"], row.at("failed").dump());
      if (fields["algorithm"] == "breaks_down") {
        EXPECT_EQ(fields["rank"], "") << "every trial failed";
        EXPECT_EQ(fields["recommended_median"], "");
        EXPECT_EQ(fields["trials"], "0");
        EXPECT_EQ(fields["in_spec_of"], "2") << "instances with failed trials count as out of specification";
        continue;
      }
      EXPECT_EQ(std::stod(fields["recommended_median"]), row.at("recommended").at("median").get<double>());
      EXPECT_EQ(std::stod(fields["recommended_hi95"]), row.at("recommended").at("hi95").get<double>());
      EXPECT_EQ(fields["yield"], "0");
      EXPECT_EQ(row.at("to_spec").at("steps"), "never");
      EXPECT_EQ(fields["steps_to_spec"], "inf");
      EXPECT_EQ(fields["seconds_to_spec"], "inf");
      EXPECT_EQ(fields["measured_median"], "");
    }
}

TEST_F(CliReportFormats, WritesToStandardOutputOrFile) {
  for (const char* format : {"csv", "json", "md"}) {
    const std::string shown = report({"results/one", "--format", format}).out;
    EXPECT_EQ(report({"results/one", "--format", format, "-o", "-"}).out, shown) << format;
    const Outcome written = report({"results/one", "--format", format, "-o", "written"});
    EXPECT_EQ(written.out, "written\n") << format << written.err;
    EXPECT_EQ(place_->read("written"), shown) << format;
  }
  const auto rows = table(report({"results/one", "two", "--format", "csv"}).out);
  ASSERT_EQ(rows.size(), 12U) << "one header for both folders";
  EXPECT_EQ(rows.front().at("results"), "results/one");
  EXPECT_EQ(rows.back().at("results"), "two");
  const json wrapped = json::parse(report({"results/one", "--format", "csv", "--json"}).out);
  EXPECT_THAT(wrapped.at("csv"), testing::StartsWith("results,scene,"));
  EXPECT_EQ(json::parse(report({"results/one", "two", "--format", "json"}).out).at("results").size(), 2U);
  // The plugin as in the run: the page states which checks were made.
  EXPECT_EQ(report({"results/one", "-o", "-", "--plugin", RELIGN_BREAKS_DOWN}).out,
            place_->read("results/one/report.html"));
}

TEST_F(CliReportFormats, HaveTheCostOfAGoodModule) {
  json suite = json::parse(kTinySuite);
  suite["name"] = "priced";
  suite["spec"] = {{"rmse", 10}};  // met at the start
  suite["algorithms"] = {"random", "home"};
  suite["cycle"] = {{"load_s", 3}};
  suite["cost"] = {{"station_per_hour", 60}, {"module", 4}, {"rework", 1}, {"baseline", "home"}, {"currency", "<EUR>"}};
  place_->write("priced.json", suite.dump());
  ASSERT_EQ(relign_bench(*place_, {"run", "priced.json"}).exit_code, 0);
  EXPECT_EQ(json::parse(place_->read("results/priced/manifest.json")).at("cost"), suite["cost"]);
  const auto rows = table(place_->read("results/priced/costs.csv"));
  ASSERT_FALSE(rows.empty());
  for (const auto& row : rows) {
    EXPECT_EQ(row.at("in_spec"), "1");
    EXPECT_NEAR(std::stod(row.at("cost_per_good")), std::stod(row.at("station_seconds")) / 60, 1e-9);
    EXPECT_NEAR(std::stod(row.at("good_per_hour")), 3600 / std::stod(row.at("station_seconds")), 1e-6);
    if (row.at("chosen") == "least_cost") {
      EXPECT_EQ(row.at("images"), "1") << "the image at the start";
    }
    EXPECT_EQ(row.at("saves").empty(), row.at("algorithm") == "home");
  }
  const json group =
      json::parse(report({"results/priced", "--format", "json"}).out).at("results").at(0).at("groups").at(0);
  EXPECT_EQ(group.at("prices").at("station_per_hour"), 60);
  EXPECT_EQ(group.at("rows").at(0).at("costs").size(), 2U);
  const std::string page = place_->read("results/priced/report.html");
  EXPECT_THAT(page, HasSubstr(">Cost</h3>"));
  EXPECT_THAT(page, HasSubstr("cost of a good module, &lt;EUR&gt;"));
  EXPECT_THAT(page, Not(HasSubstr("\u2013-"))) << "a negative end of an interval comes after a word";
}

TEST_F(CliReportFormats, HaveTheCycleOfTheSuite) {
  for (const bool computing : {false, true}) {
    json suite = json::parse(kTinySuite);
    suite["name"] = "line";
    suite["spec"] = {{"rmse", 10}};  // met at the start
    suite["algorithms"] = {"random"};
    suite["cycle"] = {{"load_s", 3}, {"cure_s", 4.5}, {"inspect_s", 2}, {"computing", computing}};
    json whole = suite["cycle"];
    whole["dispense_s"] = 0;
    place_->write("line.json", suite.dump());
    const Outcome run = relign_bench(*place_, {"run", "line.json"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(json::parse(place_->read("results/line/manifest.json")).at("cycle"), whole);
    for (auto& fields : table(report({"results/line", "--format", "csv"}).out)) {
      const double align = std::stod(fields.at("seconds_to_spec"));
      EXPECT_NEAR(std::stod(fields.at("cycle_seconds_to_spec")), align + 9.5, 1e-6) << "no step, no computing";
    }
    // In the curves alignment ends at every step.
    for (auto& fields : table(place_->read("results/line/curves.csv"))) {
      const double rest = std::stod(fields.at("cycle_seconds_median")) - std::stod(fields.at("machine_seconds_median"));
      const bool computed = computing && fields.at("step") != "0";
      EXPECT_NEAR(rest, 9.5, computed ? 1 : 1e-9);
      EXPECT_EQ(rest > 9.5 + 1e-9, computed) << rest;
    }
    EXPECT_EQ(json::parse(report({"results/line", "--format", "json"}).out)
                  .at("results")
                  .at(0)
                  .at("groups")
                  .at(0)
                  .at("rows")
                  .at(0)
                  .at("to_spec")
                  .count("cycle"),
              1u);
    EXPECT_THAT(place_->read("results/line/report.html"), HasSubstr(">cycle"));
  }
  // Without a cycle there is no column, unless another folder has one.
  EXPECT_EQ(report({"results/one", "--format", "csv"}).out.find("cycle"), std::string::npos);
  const auto both = table(report({"results/one", "results/line", "--format", "csv"}).out);
  EXPECT_EQ(both.front().at("cycle_seconds_to_spec"), "");
  EXPECT_NE(both.back().at("cycle_seconds_to_spec"), "");
}

TEST_F(CliReportFormats, RejectsConflictingOptions) {
  const Outcome figures = report({"results/one", "--format", "csv", "--figures", "paper"});
  EXPECT_EQ(figures.exit_code, 2);
  EXPECT_THAT(figures.err, HasSubstr("--figures: requires --format html"));
  EXPECT_EQ(report({"results/one", "-o", "-", "--figures", "paper"}).exit_code, 2);
  const Outcome unknown = report({"results/one", "--format", "xml"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("json"));
}

}  // namespace
}  // namespace relign::cli_test
