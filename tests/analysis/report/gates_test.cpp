#include "report/gates.h"

#include <gmock/gmock.h>

#include "records/checksum.h"
#include "records/replays.h"
#include "report/made_results.h"
#include "report/page_json.h"

namespace relign::report {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

class Gates : public MadeResults {
 protected:
  // The gate of this name; null if absent.
  Json gate(const std::string& name) {
    const Json data = to_json(page_model(load_results(folder_)));
    for (const Json& one : data["gates"])
      if (one["name"] == name) return one;
    return nullptr;
  }
  std::vector<records::TrialRecord> methods(double factor_of_b) const {
    std::vector<records::TrialRecord> trials;
    for (std::uint64_t i = 0; i < 10; ++i) {
      const double lens = 0.01 * (1 + 0.1 * static_cast<double>(i));
      trials.push_back(trial("a", i, {0.1, lens}));
      trials.push_back(trial("b", i, {0.1, factor_of_b * lens}));
    }
    return trials;
  }
  void one_algorithm_under_two_names() {
    Json algorithms = Json::array();
    for (const char* name : {"a", "b"})
      algorithms.push_back({{"name", name}, {"id", "compass"}, {"plugin_hash", "00"}, {"parameters", {{"stride", 1}}}});
    add_to_manifest({{"algorithms", algorithms}});
  }
};

TEST_F(Gates, RanNeedsAllTrials) {
  write({trial("a", 0, {0.1, 0.05})});
  EXPECT_EQ(gate("ran"), Json({{"name", "ran"}, {"ok", true}, {"text", "1/1 ran"}}));
  write({trial("a", 0, {0.1, 0.05})}, "made", 2);
  EXPECT_EQ(gate("ran")["ok"], false);
  EXPECT_EQ(gate("ran")["text"], "Only 1/3 trials have ended.");
}

TEST_F(Gates, FailuresAllowFivePercent) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 20; ++i) trials.push_back(trial("a", i, {0.1, 0.05}));
  trials[0].end = "timeout";
  write(trials);
  EXPECT_TRUE(gate("failures").is_null()) << "5 % are allowed";
  std::filesystem::remove_all(folder_);
  trials[1].end = "timeout";
  write(trials);
  EXPECT_EQ(gate("failures")["ok"], false);
  EXPECT_THAT(gate("failures")["text"].get<std::string>(), HasSubstr("10 % of the trials failed"));
}

TEST_F(Gates, AAComparesTwoNamesOfOneAlgorithm) {
  write(methods(1));
  EXPECT_TRUE(gate("A/A").is_null()) << "not known to be the same algorithm";
  one_algorithm_under_two_names();
  EXPECT_EQ(gate("A/A")["ok"], true);
  std::filesystem::remove_all(folder_);
  write(methods(1.2));
  one_algorithm_under_two_names();
  EXPECT_EQ(gate("A/A")["ok"], false);
  EXPECT_THAT(gate("A/A")["text"].get<std::string>(), HasSubstr("a and b on rho0"));
}

TEST_F(Gates, ReplayReportsTheResultOfVerify) {
  write({trial("a", 0, {0.1, 0.05})});
  EXPECT_TRUE(gate("replay").is_null());
  records::Replays replays;
  replays.all = {10, 10, 10};
  records::write_replays(folder_, replays, Json::object());
  EXPECT_EQ(gate("replay"), Json({{"name", "replay"}, {"ok", true}, {"text", "replay 10/10"}}));
  replays.all.equal = 9;
  records::write_replays(folder_, replays, Json::object());
  EXPECT_EQ(gate("replay")["ok"], false);
  for (const char* damaged :
       {"", "[]", "{\"replayed\": \"many\"}", "{\"replayed\": 0}", R"({"replayed": 10, "equal": 10})"}) {
    write_file_atomically(folder_ / "verify.json", damaged);
    EXPECT_TRUE(gate("replay").is_null()) << damaged;
  }
  records::write_replays(folder_, replays, Json::object());
  EXPECT_FALSE(gate("replay").is_null());
  write({trial("b", 0, {0.1, 0.05})});
  EXPECT_TRUE(gate("replay").is_null()) << "other records";
}

TEST_F(Gates, FailedChecksOfTheRecordsAreNamed) {
  records::TrialRecord cut = trial("a", 0, {0.1, 0.05, 0.04});
  cut.steps.pop_back();
  write({cut, trial("a", 1, {0.1, 0.05})});
  EXPECT_EQ(gate("steps")["ok"], false);
  EXPECT_THAT(
      gate("steps")["text"].get<std::string>(),
      HasSubstr("(a on relign_od rho0 #0) has 2 step lines and ended by 'budget_spent', which with a budget of 2 "
                "means 3."));
  EXPECT_TRUE(gate("checks").is_null());
  std::filesystem::remove_all(folder_);
  write({trial("a", 0, {0.1, 0.05})});
  EXPECT_EQ(gate("checks")["text"],
            "manifest, trials, steps, scores, instances checked, plan not (this command looks for no plugins)");
}

// A busy machine affects compute times but not errors.
TEST_F(Gates, HarnessOverheadIsACaveatAndNoFailedGate) {
  const auto with_harness = [&](double seconds) {
    std::filesystem::remove_all(folder_);
    write({trial("a", 0, {0.1, 0.05})});
    records::TrialTimes times;
    times.trial = trial("a", 0, {}).trial;
    times.algorithm_seconds = times.simulation_seconds = times.truth_seconds = {0.001, 0.001};
    times.harness_seconds = seconds;
    write_file_atomically(folder_ / "times" / "0000.jsonl", records::with_checksum(to_line(times)) + "\n");
    return to_json(page_model(load_results(folder_)));
  };
  const auto warns = Contains(HasSubstr("Harness overhead was 25 % of the scene's time"));
  EXPECT_THAT(with_harness(0.0001)["caveats"].get<std::vector<std::string>>(), Not(warns));
  const Json busy = with_harness(0.001);  // a quarter of the scene's four milliseconds
  EXPECT_THAT(busy["caveats"].get<std::vector<std::string>>(), warns);
  for (const Json& one : busy["gates"]) EXPECT_EQ(one["ok"], true) << one;
}

}  // namespace
}  // namespace relign::report
