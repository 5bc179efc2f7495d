// A scene that owns its stage, from suite to report.
#include <cmath>
#include <set>

#include "plugin_host/catalog.h"
#include "runner/trial_runner.h"
#include "runner/verify.h"
#include "toy_suites.h"

namespace relign::runner {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

class StationTest : public ToyTest {
 protected:
  PreparedPlan station_plan(const std::string& suite) {
    plugin_host::Catalog catalog;
    const fs::path toys = RELIGN_RUNNER_TEST_PLUGINS, ours = RELIGN_PLUGIN_DIR;
    for (const fs::path& plugin : {toys / "toy_station", toys / "toy_scene", toys / "toy_walker", toys / "toy_level",
                                   ours / "none", ours / "home", ours / "random"})
      catalog.add(plugin);
    return prepare(suites::read_suite(JsonSource::from_text(suite, "station.json"), ".", catalog), {},
                   [this](const std::string& message) { messages_.push_back(message); });
  }
  static std::string suite(const std::string& parameters = "{}", const std::string& more = "") {
    return R"({"scenes": [{"use": "toy-station", "name": "bench", "parameters": )" + parameters +
           R"(}], "noise_levels": ["none"], "algorithms": ["toy-walker"], "instances": 4, "steps": 3)" + more + "}";
  }
};

TEST_F(StationTest, RecordsUnknownAsNullAndMeasurements) {
  const PreparedPlan plan = station_plan(suite());
  EXPECT_THAT(messages_, Contains(AllOf(HasSubstr("skipping home"), HasSubstr("'bench'"))));
  ASSERT_EQ(plan.plan.trials.size(), 8U);  // toy-walker and random
  const RunSummary summary = run(plan, options("a", 3));
  EXPECT_EQ(summary.finished, 8U);
  EXPECT_EQ(summary.failed, 0U);
  EXPECT_THAT(messages_, Contains(HasSubstr("a station runs one trial at a time")));
  for (const records::TrialRecord& record : records::read_trials(folder_ / "a")) {
    ASSERT_EQ(record.steps.size(), 4U);
    EXPECT_EQ(record.steps[0].commanded_pose, std::vector<double>({0, 0}));  // relative to the start
    EXPECT_DOUBLE_EQ(record.steps[0].machine_seconds, 0.5);
    EXPECT_DOUBLE_EQ(record.steps[3].machine_seconds, 0.5 + 3 * 0.75);
    for (const records::StepRecord& step : record.steps) {
      EXPECT_TRUE(std::isfinite(step.measured));
      EXPECT_EQ(step.merit, step.measured);
      ASSERT_EQ(step.true_pose.size(), 2U);
      EXPECT_TRUE(std::isnan(step.true_pose[0]) && std::isnan(step.recommended_true_pose[1]));
      EXPECT_TRUE(std::isnan(step.commanded_mse) && std::isnan(step.recommended_mse));
      EXPECT_TRUE(std::isnan(step.recommended_seconds));
      EXPECT_EQ(step.recommended_pose.size(), 2U);
    }
  }
  EXPECT_THAT(read_file(folder_ / "a/trials/0000.jsonl"),
              AllOf(HasSubstr(R"("true_pose":[null,null])"), HasSubstr(R"("recommended_mse":null)")));
  const Json manifest = records::read_manifest_json(folder_ / "a");
  EXPECT_EQ(manifest["scenes"][0]["replayable"], false);
  EXPECT_EQ(manifest["scenes"][0]["truth"], false);
  EXPECT_EQ(manifest["scenes"][0]["owns_stage"], true);
}

TEST_F(StationTest, KeepsFirstAndLastCaptureOfEachTrial) {
  run(station_plan(suite()), options("a"));
  const Json index = Json::parse(read_file(folder_ / "a/pictures/index.json"));
  ASSERT_EQ(index["trials"].size(), 6U);
  for (const Json& trial : index["trials"]) {
    EXPECT_EQ(trial["shows"], "last_capture");
    ASSERT_EQ(trial["frames"].size(), 2U);
    EXPECT_EQ(trial["frames"][1]["step"], 3);
  }
  EXPECT_EQ(index["references"].size(), 1U);
}

TEST_F(StationTest, TrialsAreCountedAndNotReplayed) {
  run(station_plan(suite()), options("a"));
  VerifyOptions verified;
  verified.results = folder_ / "a";
  plugin_host::Catalog none;  // not even its plugins are needed
  const VerifySummary summary = verify(verified, none);
  EXPECT_EQ(summary.stations, 8U);
  EXPECT_EQ(summary.replayed, 0U);
  EXPECT_TRUE(summary.all_equal());
}

TEST_F(StationTest, RecordsFailureWithoutRetry) {
  const PreparedPlan plan = station_plan(suite(R"({"fails_at_move": 2})"));
  const RunSummary summary = run(plan, options("a"));
  EXPECT_EQ(summary.finished, 8U);
  EXPECT_EQ(summary.failed, 4U);
  std::size_t failed = 0;
  std::set<std::string> messages;
  for (const records::TrialRecord& record : records::read_trials(folder_ / "a")) {
    if (record.end != "failed") continue;
    ++failed;
    EXPECT_EQ(record.steps.size(), 2U);  // completed steps are kept
    EXPECT_THAT(record.message, AllOf(HasSubstr("toy-station"), HasSubstr("lost its reference")));
    messages.insert(record.message);
  }
  // Every second trial failed, so that no trial was started twice.
  EXPECT_EQ(failed, 4U);
  EXPECT_EQ(messages.size(), 4U);

  const auto before = contents("a");
  const RunSummary again = run(plan, options("a"));
  EXPECT_EQ(again.reused, 8U);
  EXPECT_EQ(contents("a"), before);
}

TEST_F(StationTest, RejectsNoiseLevelAndCombinedMerit) {
  const std::string level = error_text(ErrorKind::bad_input, [this] {
    station_plan(R"({"scenes": ["toy-station"], "noise_levels": ["toy-level"], "algorithms": ["toy-walker"]})");
  });
  EXPECT_THAT(level, AllOf(HasSubstr("'toy-level'"), HasSubstr("toy-station"), HasSubstr("use 'none'")));
  const std::string merit = error_text(ErrorKind::bad_input, [this] {
    station_plan(R"({"scenes": ["toy-station"], "noise_levels": ["none"],
                     "algorithms": [{"use": "toy-walker", "merit": "combined"}]})");
  });
  EXPECT_THAT(merit, HasSubstr("use 'rmse'"));
}

TEST_F(StationTest, RejectsMeritsByFieldOfScenesWithoutFields) {
  for (const std::string merit : {"mtf", "edge_energy"}) {
    const std::string mistake = error_text(ErrorKind::bad_input, [&] {
      station_plan(R"({"scenes": ["toy-scene"], "noise_levels": ["none"],
                       "algorithms": [{"use": "toy-walker", "merit": ")" +
                   merit + "\"}]}");
    });
    EXPECT_THAT(mistake,
                AllOf(HasSubstr("'toy-walker': merit '" + merit + "' needs slanted edges"), HasSubstr("camera_2mp")));
  }
}

TEST_F(StationTest, SkipsHomeOnlyOnTheStation) {
  const PreparedPlan plan = station_plan(
      R"({"scenes": ["toy-station", "toy-scene"], "noise_levels": ["none"], "algorithms": ["random"], "instances": 2,
          "steps": 3})");
  ASSERT_EQ(plan.plan.trials.size(), 6U);
  EXPECT_EQ(run(plan, options("a")).failed, 0U);
  for (const records::TrialRecord& record : records::read_trials(folder_ / "a"))
    EXPECT_EQ(std::isnan(record.steps.back().recommended_mse), record.scene == "toy-station");
}

}  // namespace
}  // namespace relign::runner
