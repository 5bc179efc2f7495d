// Which folders can be merged, and how records of one trial in several folders are resolved.
#include <cmath>
#include <fstream>

#include "merge_fixture.h"
#include "records/checksum.h"
#include "records/line_files.h"
#include "records/manifest_check.h"

namespace relign::records {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Optional;

TEST_F(MergeTest, MergesNewAlgorithmIntoStudyInPlanOrder) {
  const fs::path study =
      make("study", {trial("w0"), trial("w1"), trial("w2")}, manifest({"walker"}, {"w0", "w1", "w2"}));
  const fs::path ours = make("ours", {trial("r2"), trial("r0"), trial("r1")}, manifest({"runner"}, {"r0", "r1", "r2"}));
  const MergeSummary summary = join({study, ours});
  EXPECT_EQ(summary.trials, 6U);
  EXPECT_EQ(summary.missing + summary.duplicates + summary.disagreeing + summary.left_out, 0U);
  EXPECT_THAT(merged(), ElementsAre("w0", "w1", "w2", "r0", "r1", "r2"));
  EXPECT_EQ(read_times(folder_ / "out").size(), 6U);
  EXPECT_EQ(to_lines(read_trials(folder_ / "out")[3]), to_lines(trial("r0")));
  const Json joined = read_manifest_json(folder_ / "out");
  EXPECT_EQ(joined["algorithms"].size(), 2U);
  ASSERT_EQ(joined["sources"].size(), 2U);
  EXPECT_EQ(joined["sources"][1]["folder"], ours.string());
  EXPECT_EQ(joined["sources"][1]["trials"], 3);
  EXPECT_EQ(joined["sources"][1]["plugins"]["algorithms"]["runner"], "hrunner");
  EXPECT_EQ(joined["suites"][joined["sources"][1]["suite"].get<std::size_t>()]["text"],
            "{\"algorithms\": [\"runner\"]}");
  EXPECT_THAT(notes_, IsEmpty());
  EXPECT_FALSE(fs::exists(folder_ / "out.merging"));
}

TEST_F(MergeTest, NamesAllBuildsOfAResumedFolder) {
  Json resumed = manifest({"walker"}, {"w0"});
  resumed["earlier_programs"] = Json::array({Json{{"version", "0"}, {"hash", "q"}, {"flags", "-O3"}}});
  join({make("a", {trial("w0")}, resumed), make("b", {trial("r0")}, manifest({"runner"}, {"r0"}))});
  EXPECT_THAT(notes_, ElementsAre("results from 2 builds of relign-bench"));
  const Json joined = read_manifest_json(folder_ / "out");
  EXPECT_FALSE(joined.contains("earlier_programs"));
  EXPECT_EQ(manifest_of(folder_ / "out").builds_note(), notes_.front());
}

TEST_F(MergeTest, ShardsMergeToTheBytesOfOneRun) {
  const Json whole = manifest({"walker", "runner"}, {"w0", "w1", "r0", "r1"});
  make("one", {trial("w0"), trial("w1"), trial("r0"), trial("r1")}, whole);
  const auto shard = [&](unsigned number, const std::vector<std::string>& ids) {
    Json part = whole;
    part["order"] = ids;
    part["trials"] = ids.size();
    part["shard"] = {{"number", number}, {"of", 3}, {"plan", "f00"}};
    std::vector<TrialRecord> trials;
    for (const std::string& id : ids) trials.push_back(trial(id));
    make("parts/shard-000" + std::to_string(number) + ".node", trials, part);
  };
  shard(1, {"w1", "r1"});
  EXPECT_THAT(join({folder_ / "parts"}).missing_shards, Optional(ElementsAre(0, 2)));
  shard(0, {"w0", "r0"});
  const MergeSummary summary = join({folder_ / "parts"});  // what merge made is replaced
  EXPECT_EQ(summary.shards, 3U);
  EXPECT_THAT(summary.missing_shards, Optional(ElementsAre(2)));
  EXPECT_EQ(bytes("out/trials/0000.jsonl"), bytes("one/trials/0000.jsonl"));
  EXPECT_EQ(bytes("out/times/0000.jsonl"), bytes("one/times/0000.jsonl"));
  EXPECT_EQ(read_manifest_json(folder_ / "out")["order"], whole["order"]);
}

TEST_F(MergeTest, DropsEqualDuplicatesAndReportsDifferentOnes) {
  TrialRecord other = trial("w1");
  other.steps[2].measured = std::nextafter(other.steps[2].measured, 1);
  const fs::path a = make("a", {trial("w0"), trial("w1")}, manifest({"walker"}, {"w0", "w1"}));
  const fs::path b = make("b", {trial("w0"), other}, manifest({"walker"}, {"w0", "w1"}));
  const MergeSummary summary = join({a, b});
  EXPECT_EQ(summary.trials, 2U);
  EXPECT_EQ(summary.duplicates, 1U);
  EXPECT_EQ(summary.disagreeing, 1U);
  ASSERT_EQ(summary.disagreements.size(), 1U);
  const Disagreement& one = summary.disagreements[0];
  EXPECT_EQ(one.label, "walker on toy calm #1");
  EXPECT_EQ(one.kept, a.string());
  EXPECT_EQ(one.difference.step, 2U);
  EXPECT_EQ(one.difference.field, "measured");
  EXPECT_NE(one.difference.was, one.difference.is);
  EXPECT_EQ(to_lines(read_trials(folder_ / "out")[1]), to_lines(trial("w1")));  // the first one given
  EXPECT_EQ(read_manifest_json(folder_ / "out")["merge"]["disagreements"][0]["difference"]["field"], "measured");
}

TEST_F(MergeTest, ToleratesThisCpuPluginsBetweenProcessorsOnly) {
  TrialRecord other = trial("w0");
  other.steps[2].measured -= 1e-9;
  Json here = manifest({"walker"}, {"w0"}), there = here;
  here["algorithms"][0]["reproducible"] = there["algorithms"][0]["reproducible"] = "this_cpu";
  const fs::path a = make("a", {trial("w0")}, here);
  const fs::path same = make("same", {other}, there);
  EXPECT_EQ(join({a, same}).disagreeing, 1U);
  there["machine"]["cpu"] = "two";
  const fs::path b = make("b", {other}, there);
  const MergeSummary summary = join({a, b});
  EXPECT_EQ(summary.disagreeing, 0U);
  EXPECT_EQ(summary.within_tolerance, 1U);
  EXPECT_THAT(notes_, ElementsAre(HasSubstr("one (1 folder), two (1 folder)")));
  // Compares instruction sets where both manifests have them.
  here["machine"]["instruction_sets"] = there["machine"]["instruction_sets"] = "amd: sse3";
  EXPECT_EQ(join({make("a1", {trial("w0")}, here), make("b1", {other}, there)}).disagreeing, 1U);
  there["machine"]["instruction_sets"] = "amd: sse3 avx2";
  EXPECT_EQ(join({make("a2", {trial("w0")}, here), make("b2", {other}, there)}).within_tolerance, 1U);
  there["machine"].erase("instruction_sets");
  other.steps[2].measured -= 1e-3;
  const fs::path c = make("c", {other}, there);
  EXPECT_EQ(join({a, c}).disagreeing, 1U);
}

TEST_F(MergeTest, PrefersFinishedTrialsToFailedAttempts) {
  TrialRecord early = trial("w0");
  early.end = "failed";
  early.message = "lost";
  early.steps.pop_back();
  const fs::path a = make("a", {early}, manifest({"walker"}, {"w0"}));
  const fs::path b = make("b", {trial("w0")}, manifest({"walker"}, {"w0"}));
  const MergeSummary summary = join({a, b});
  EXPECT_EQ(summary.superseded, 1U);
  EXPECT_EQ(summary.disagreeing, 0U);
  EXPECT_EQ(read_trials(folder_ / "out").at(0).end, "budget_spent");
  early.steps[1].true_pose[0] = 0.7;  // ... unless its steps differ
  const fs::path c = make("c", {early}, manifest({"walker"}, {"w0"}));
  EXPECT_EQ(join({c, b}).disagreeing, 1U);
}

TEST_F(MergeTest, CountsHalfWrittenAndMissingTrialsAndKeepsPlanOrder) {
  std::vector<std::string> order;
  std::vector<TrialRecord> trials;
  for (int number = 0; number < 1002; ++number) {
    order.push_back("w" + std::to_string(number));
    if (number != 5) trials.push_back(trial(order.back()));
  }
  const fs::path a = make("a", trials, manifest({"walker"}, order));
  const std::string half = to_lines(trial("w5"));
  std::ofstream(a / "trials/0001.jsonl", std::ios::app) << half.substr(0, half.rfind("{\"format"));
  const MergeSummary summary = join({a});
  EXPECT_EQ(summary.trials, 1001U);
  EXPECT_EQ(summary.missing, 1U);
  EXPECT_EQ(summary.half_written, 1U);
  EXPECT_EQ(read_manifest_json(folder_ / "out")["order"], order);
  const std::string second = bytes("out/trials/0001.jsonl");
  EXPECT_THAT(second, testing::StartsWith("{\"trial\":\"w1000\""));  // place 1000, w5 counted
}

TEST_F(MergeTest, RejectsOtherInstancesAndNamesDifferences) {
  const fs::path a = make("a", {trial("w0")}, manifest({"walker"}, {"w0"}));
  Json other = manifest({"walker"}, {"w1"});
  other["instance_set"] = "5e8";
  other["seed"] = 7;
  other["scenes"][0]["identity"] = "j";
  const fs::path b = make("b", {trial("w1")}, other);
  EXPECT_THAT(refused({a, b}),
              testing::AllOf(HasSubstr("cannot merge"), HasSubstr("seed: 1 in " + a.string() + ", 7 in"),
                             HasSubstr("scene 'toy', identity: \"i\"")));
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  EXPECT_FALSE(fs::exists(folder_ / "out.merging"));
  Json hard = manifest({"walker"}, {"w1"});
  hard["limits"] = "hard";
  EXPECT_THAT(refused({a, make("c", {trial("w1")}, hard)}), HasSubstr("limits: \"soft\""));
}

TEST_F(MergeTest, RejectsDifferentAlgorithmsOfOneName) {
  const fs::path a = make("a", {trial("w0")}, manifest({"walker"}, {"w0"}));
  Json other = manifest({"walker"}, {"w1"});
  other["algorithms"][0]["parameters"]["stride"] = 0.2;
  EXPECT_THAT(
      refused({a, make("b", {trial("w1")}, other)}),
      testing::AllOf(HasSubstr("'walker' (protocol paper)"), HasSubstr("\"stride\":0.2"), HasSubstr("\"name\"")));
  // The same parameters, but another model file: only the id differs.
  TrialRecord another = trial("w0");
  another.trial = "x0";
  EXPECT_THAT(refused({a, make("c", {another}, manifest({"walker"}, {"x0"}))}),
              testing::AllOf(HasSubstr("w0"), HasSubstr("x0"), HasSubstr("both walker on toy calm #0")));
}

TEST_F(MergeTest, TakesDamagedTrialsFromOtherFolders) {
  const fs::path a = make("a", {trial("w0"), trial("w1")}, manifest({"walker"}, {"w0", "w1"}));
  const fs::path b = make("b", {trial("w0"), trial("w1")}, manifest({"walker"}, {"w0", "w1"}));
  std::string changed = bytes("a/trials/0000.jsonl");
  changed[changed.find("\"measured\":0.04", changed.find("w1")) + 13] = '9';
  write_file_atomically(a / "trials/0000.jsonl", changed);
  EXPECT_THAT(refused({a}), HasSubstr("trial w1 is damaged"));
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  EXPECT_EQ(join({a, b}).trials, 2U);
  EXPECT_EQ(bytes("out/trials/0000.jsonl"), bytes("b/trials/0000.jsonl"));
  EXPECT_THAT(notes_, testing::Contains(testing::AllOf(HasSubstr("w1"), HasSubstr("another folder has the trial"))));
}

TEST_F(MergeTest, RefusesAFalseNumberOfTrials) {
  Json false_number = manifest({"walker"}, {"w0", "w1"});
  false_number["trials"] = 1;
  EXPECT_THAT(refused({make("a", {trial("w0")}, false_number)}), HasSubstr("'trials' is 1, but 'order' has 2"));
}

TEST_F(MergeTest, RejectsNewerDamagedAndForeignFolders) {
  const fs::path a = make("a", {trial("w0")}, manifest({"walker"}, {"w0"}));
  Json newer = manifest({"walker"}, {"w0"});
  newer["format"] = 2;
  fs::create_directories(folder_ / "newer");
  write_file_atomically(folder_ / "newer/manifest.json", newer.dump());
  EXPECT_THAT(refused({a, folder_ / "newer"}), HasSubstr("newer"));
  const fs::path damaged = make("damaged", {trial("w1")}, manifest({"walker"}, {"w1"}));
  std::ofstream(damaged / "trials/0000.jsonl", std::ios::app) << "malformed\n";
  EXPECT_THAT(refused({a, damaged}), HasSubstr("0000.jsonl:5"));
  EXPECT_THAT(refused({a}, "a/../a"), HasSubstr("one of the folders to merge"));
  EXPECT_THAT(refused({a}, "newer"), HasSubstr("newer"));
  EXPECT_THAT(refused({a}, "damaged"), HasSubstr("contains the results of a run"));
  fs::create_directories(folder_ / "mine/notes");
  EXPECT_THAT(refused({a}, "mine"), HasSubstr("not empty"));
  EXPECT_THAT(refused({folder_ / "mine"}), HasSubstr("is not a results folder"));
  EXPECT_EQ(read_trials(a).size(), 1U);
}

}  // namespace
}  // namespace relign::records
