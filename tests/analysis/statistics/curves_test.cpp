#include "statistics/curves.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/files.h"
#include "base/text.h"
#include "error_text.h"
#include "statistics/made_table.h"
#include "statistics/study.h"

namespace relign::statistics::curve_tests {
namespace {

using test::error_text;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Without bands, which have their own tests.
std::vector<Curve> make_curves(const TrialTable& table, std::size_t most_bytes = kCurveBytes) {
  StudyOptions options;
  options.resamples = 0;
  options.most_bytes = most_bytes;
  std::vector<Curve> curves;
  for (const SeriesStudy& series : make_study(table, options).series) curves.push_back(series.curve);
  return curves;
}

using Curves = MadeTable;
using Instances = MadeTable;
using Ranking = MadeTable;

// A trial with these noise-free RMSE at the commanded and at the recommended pose; multiples of 1/16, so that tables
// are exact.
records::TrialRecord trial(const std::string& algorithm, std::uint64_t instance, std::vector<double> measured,
                           std::vector<double> commanded, std::vector<double> recommended, unsigned budget = 2) {
  records::TrialRecord record;
  record.trial = algorithm.substr(0, 6) + std::to_string(instance);
  record.scene = "toy";
  record.noise_level = "calm";
  record.protocol = "paper";
  record.algorithm = algorithm;
  record.instance = instance;
  record.end = measured.size() == budget + 1U ? "budget_spent" : "finished";
  record.budget = budget;
  for (std::size_t number = 0; number < measured.size(); ++number) {
    records::StepRecord step;
    step.step = static_cast<unsigned>(number);
    step.measured = measured[number];
    step.commanded_mse = commanded[number] * commanded[number];
    step.recommended_mse = recommended[number] * recommended[number];
    step.machine_seconds = static_cast<double>(number);
    step.recommended_seconds = static_cast<double>(number) + 0.5;
    step.recommendation = "own";
    record.steps.push_back(step);
  }
  return record;
}

std::vector<records::TrialRecord> sample() {
  std::vector<records::TrialRecord> trials = {
      trial("walker", 0, {0.5, 0.75, 0.25}, {0.5, 0.625, 0.125}, {0.5, 0.5, 0.125}),
      trial("walker", 1, {0.75, 0.5, 0.625}, {0.625, 0.375, 0.5}, {0.625, 0.375, 0.375}),
      trial("walker", 2, {1, 0.25}, {0.875, 0.25}, {0.875, 0.25}),  // finished early
      trial("walker", 3, {0.25, 0.5, 0.125}, {0.25, 0.5, 0.0625}, {0.25, 0.25, 0.0625}),
      trial("walker", 4, {0.5}, {0.5}, {0.5}),
      trial("jumper, \"quick\"", 0, {0.5, 0.25, 0.5}, {0.5, 0.25, 0.5}, {0.5, 0.25, 0.25}),
  };
  trials[4].end = "failed";
  trials[4].message = "lost,\nfor good";
  for (std::size_t index = 0; index < 4; ++index) {
    // The last recommendation of trial 3 is below its own optimum: excess 0.
    trials[index].own_optimum.mse = index == 3 ? 0.25 : 0.0;
  }
  return trials;
}

TEST_F(Curves, ExcludeFailedTrials) {
  const std::vector<Curve> curves = make_curves(table(sample()));
  ASSERT_EQ(curves.size(), 2U);
  EXPECT_EQ(curves[0].algorithm, "walker");
  EXPECT_EQ(curves[0].trials, 4U);
  EXPECT_EQ(curves[0].failed, 1U);
  ASSERT_EQ(curves[0].points.size(), 3U);
  EXPECT_EQ(curves[1].algorithm, "jumper, \"quick\"");
}

TEST_F(Curves, HaveNoPointsIfAllTrialsFailed) {
  std::vector<records::TrialRecord> trials = {sample()[4]};
  const std::vector<Curve> curves = make_curves(table(trials));
  ASSERT_EQ(curves.size(), 1U);
  EXPECT_EQ(curves[0].trials, 0U);
  EXPECT_TRUE(curves[0].points.empty());
  const auto rows = ranking(table(trials));
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].failed, 1U);
  EXPECT_TRUE(std::isnan(rows[0].recommended.median));
}

// The golden file was written from the same numbers by NumPy.
TEST_F(Curves, CsvMatchesTheGoldenFile) {
  EXPECT_EQ(curves_csv(make_curves(table(sample()))), read_file(std::string(RELIGN_TEST_DATA) + "/stats_curves.csv"));
}

TEST_F(Curves, AreIndependentOfTheMemoryLimit) {
  const TrialTable trials = table(sample());
  const std::string whole = curves_csv(make_curves(trials));
  // For four trials: one step of a track, two steps, a whole track; a limit of 0 works as well.
  for (const std::size_t bytes : {std::size_t{0}, 4 * sizeof(double), 8 * sizeof(double), 12 * sizeof(double)})
    EXPECT_EQ(curves_csv(make_curves(trials, bytes)), whole) << bytes;
}

TEST_F(Curves, ReportAChangedFolder) {
  const TrialTable trials = table(sample());
  write_file_atomically(folder_ / "trials" / "0000.jsonl", "");
  EXPECT_THAT(error_text(ErrorKind::io, [&] { make_curves(trials); }), HasSubstr("is a run writing it?"));
}

TEST_F(Curves, JsonMatchesTheCsv) {
  const Json json = curves_json(make_curves(table(sample())));
  EXPECT_EQ(json["format"], 1);
  ASSERT_EQ(json["curves"].size(), 2U);
  const Json& walker = json["curves"][0];
  EXPECT_EQ(walker["n"], 4);
  EXPECT_EQ(walker["failed"], 1);
  EXPECT_EQ(walker["step"], Json({0, 1, 2}));
  EXPECT_EQ(walker["tracks"]["recommended"]["median"], Json({0.5625, 0.3125, 0.1875}));
  EXPECT_EQ(json["curves"][1]["tracks"]["excess"]["median"], Json({nullptr, nullptr, nullptr}));
}

// The fields of an instance for the columns of steps with kTabled.
std::string tabled(const std::vector<records::TrialRecord>& trials, const std::string& id) {
  std::string fields;
  for (const records::TrialRecord& trial : trials)
    if (trial.trial == id)
      for (const double value : records::tabled_values(trial.steps.back()))
        fields += (std::isfinite(value) ? shortest(value) : "") + ",";
  return fields;
}

TEST_F(Instances, HaveOneRowPerTrial) {
  std::string csv, keys;
  const records::StepRecord none;
  records::step_columns(
      [&keys](const records::Column& column, const auto&) {
        if (column.is(records::kTabled)) keys += std::string(column.key) + ",";
      },
      none);
  instances_csv(table(sample()), [&](std::string_view text) { csv += text; });
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 7);
  EXPECT_THAT(csv, testing::StartsWith("trial,scene,noise_level,protocol,algorithm,instance,end,steps,budget,measured,"
                                       "best,commanded,recommended,excess," +
                                       keys + "recommendation,message,recommended_best,recommended_current\n"));
  EXPECT_THAT(keys, testing::StartsWith("machine_seconds,recommended_seconds,"));
  const std::string walker = tabled(sample(), "walker2");
  EXPECT_THAT(walker, testing::StartsWith("1,1.5,"));
  EXPECT_THAT(csv, HasSubstr("\nwalker2,toy,calm,paper,walker,2,finished,1,2,0.25,0.25,0.25,0.25,0.25," + walker +
                             "own,,0.25,0.25\n"));
  EXPECT_THAT(csv, HasSubstr(",own,,0.375,0.5\n")) << "walker1 has its lowest measured error one step before its last";
  EXPECT_THAT(csv, HasSubstr("\"jumper, \"\"quick\"\"\",0,budget_spent,2,2,0.5,0.25,0.5,0.25,," +
                             tabled(sample(), "jumper0") + "own,,0.25,0.5\n"));
  EXPECT_THAT(csv, HasSubstr("failed,0,2,,,,,," + tabled(sample(), "walker4") + "own,\"lost, / for good\",,\n"))
      << "no scores of a failed trial";
}

TEST_F(Ranking, PutsTheBestMedianFirstWithinItsGroup) {
  std::vector<records::TrialRecord> trials = sample();
  records::TrialRecord other = trials[5];
  other.noise_level = "wild";
  other.trial = "other";
  trials.push_back(other);
  records::TrialTimes times;
  times.trial = "walker0";
  times.algorithm_seconds = {0.25, 0.25, 0.5};  // two steps after step 0
  const auto rows = ranking(table(trials, {times}));
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].algorithm, "walker");  // 0.1875 against the jumper's 0.25
  EXPECT_EQ(rows[0].recommended.median, 0.1875);
  EXPECT_EQ(rows[0].step, 2U);
  EXPECT_EQ(rows[0].trials, 4U);
  EXPECT_EQ(rows[0].failed, 1U);
  EXPECT_EQ(rows[0].machine_seconds_median, 2.5);
  EXPECT_EQ(rows[0].algorithm_ms_per_step_median, 500);
  EXPECT_EQ(rows[1].noise_level, "calm");
  EXPECT_TRUE(std::isnan(rows[1].algorithm_ms_per_step_median));
  EXPECT_EQ(rows[2].noise_level, "wild");
  // With larger errors for the walker the ranking changes, though the order of the trials does not.
  for (records::TrialRecord& record : trials)
    if (record.algorithm == "walker")
      for (records::StepRecord& step : record.steps) step.recommended_mse = 1;
  EXPECT_EQ(ranking(table(trials))[0].algorithm, "jumper, \"quick\"");
}

}  // namespace
}  // namespace relign::statistics::curve_tests
