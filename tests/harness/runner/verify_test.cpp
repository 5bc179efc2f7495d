#include "runner/verify.h"

#include <sstream>

#include "base/hash.h"
#include "resealed.h"
#include "runner/frozen_plan.h"
#include "runner/provenance.h"
#include "runner/verify_folder.h"
#include "toy_suites.h"

namespace relign::runner {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class VerifyTest : public ToyTest {
 protected:
  VerifySummary check(const std::string& name, const std::string& walker = "toy_walker") {
    plugin_host::Catalog catalog = toys(walker);
    VerifyOptions options = verify_options(name);
    return verify(options, catalog);
  }
  VerifyOptions verify_options(const std::string& name) {
    VerifyOptions options;
    options.results = folder_ / name;
    options.workers = 2;
    return options;
  }
  // As a forger does it, who renews the checksums.
  void change(const std::string& file, const std::string& from, const std::string& to) {
    std::istringstream lines(read_file(folder_ / file));
    std::string text;
    for (std::string line; std::getline(lines, line);) text += records::without_checksum(line) + "\n";
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write_file_atomically(folder_ / file, records::resealed(text.replace(at, from.size(), to)));
  }
  void edit_manifest(const std::function<void(Json&)>& edit) {
    Json manifest = records::read_manifest_json(folder_ / "a");
    edit(manifest);
    write_file_atomically(folder_ / "a/manifest.json", manifest.dump());
  }
};

TEST(VerifySummary, OfNoReplayVouchesForNothing) {
  VerifySummary summary;
  summary.recorded = 2;
  EXPECT_TRUE(summary.all_equal() && summary.nothing());
  summary.stations = 2;  // nothing else is to be expected of a station
  EXPECT_FALSE(summary.nothing());
  summary.stations = 0;
  summary.replayed = 1;
  EXPECT_FALSE(summary.nothing());
}

TEST_F(VerifyTest, ReplayEqualsRecordsIncludingFailures) {
  run(prepared(suite_text(kWalkers)), options("a", 2));
  const VerifySummary summary = check("a");
  EXPECT_EQ(summary.recorded, 36U);
  EXPECT_EQ(summary.replayed, 36U);
  EXPECT_EQ(summary.equal, 36U);
  EXPECT_EQ(summary.with_tolerance, 0U);
  EXPECT_THAT(summary.differences, IsEmpty());
  EXPECT_THAT(summary.changes, IsEmpty());
  EXPECT_TRUE(summary.all_equal());
}

TEST_F(VerifyTest, FindsForgedNumberByStepAndField) {
  run(prepared(suite_text(R"("toy-walker")")), options("a"));
  records::TrialRecord forged = records::read_trials(folder_ / "a")[4];
  const std::string honest = records::to_lines(forged);
  forged.steps[2].recommended_mse /= 2;
  change("a/trials/0000.jsonl", honest, records::to_lines(forged));
  const VerifySummary summary = check("a");
  EXPECT_EQ(summary.equal, 11U);
  ASSERT_EQ(summary.differences.size(), 1U);
  const ReplayDifference& one = summary.differences[0];
  EXPECT_EQ(one.trial, forged.trial);
  EXPECT_EQ(one.label, "toy-walker on toy-scene toy-level #4");
  EXPECT_EQ(one.difference.step, 2U);
  EXPECT_EQ(one.difference.field, "recommended_mse");
  EXPECT_FALSE(summary.all_equal());
  EXPECT_THAT(summary.changes, IsEmpty());
}

TEST_F(VerifyTest, ReportsDifferentBytesOfEqualNumbers) {
  run(prepared(suite_text(R"("toy-walker")")), options("a"));
  change("a/trials/0000.jsonl", "\"step\":3,", "\"step\":3, ");
  const VerifySummary summary = check("a");
  ASSERT_EQ(summary.differences.size(), 1U);
  EXPECT_EQ(summary.differences[0].difference.field, "bytes of the lines");
}

TEST_F(VerifyTest, NamesDamagedTrialsAndReplaysTheOthers) {
  run(prepared(suite_text(R"("toy-walker")")), options("a"));
  const std::string id = records::read_trials(folder_ / "a")[4].trial;
  std::string text = read_file(folder_ / "a/trials/0000.jsonl");
  text[text.find("\"measured\":", text.find(id)) + 14] ^= 1;
  write_file_atomically(folder_ / "a/trials/0000.jsonl", text);
  const VerifySummary summary = check("a");
  EXPECT_EQ(summary.equal, 11U);
  ASSERT_EQ(summary.damaged.size(), 1U);
  EXPECT_EQ(summary.damaged[0].trial, id);
  EXPECT_FALSE(summary.all_equal());
  VerifyOptions one = verify_options("a");
  one.trial = id;
  plugin_host::Catalog catalog = toys("toy_walker");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { verify(one, catalog); }), HasSubstr(id + " is damaged"));
}

TEST_F(VerifyTest, NamesChangedPlugin) {
  run(prepared(suite_text(R"("toy-walker", "toy-stumbler")")), options("a"));
  const VerifySummary summary = check("a", "toy_walker_changed");
  EXPECT_EQ(summary.replayed, 24U);
  EXPECT_EQ(summary.equal, 12U);  // the other algorithm's
  ASSERT_EQ(summary.changes.size(), 1U);
  EXPECT_EQ(summary.changes[0].what, "plugin toy-walker");
  EXPECT_NE(summary.changes[0].was, summary.changes[0].is);
}

TEST_F(VerifyTest, ReportsAnotherProcessorAndProgram) {
  run(prepared(suite_text(R"("toy-walker")")), options("a"));
  edit_manifest([](Json& manifest) {
    manifest["machine"] = {{"cpu", "Abacus"}, {"cores", 1}, {"system", "beads"}};
    manifest["program"]["flags"] = "-O0";
  });
  VerifySummary summary = check("a");
  EXPECT_TRUE(summary.all_equal());  // these toys are reproducible anywhere
  EXPECT_EQ(summary.with_tolerance, 0U);
  ASSERT_EQ(summary.changes.size(), 2U);
  EXPECT_EQ(summary.changes[0].what, "CPU");
  EXPECT_EQ(summary.changes[0].was, "Abacus");
  EXPECT_EQ(summary.changes[1].what, "program flags");
  // The folder was resumed by this build.
  edit_manifest([](Json& manifest) {
    manifest["earlier_programs"] = {manifest["program"]};
    manifest["program"] = json_of(this_program());
    manifest["earlier_programs"][0]["hash"] = std::string(64, '0');
  });
  summary = check("a");
  ASSERT_EQ(summary.changes.size(), 3U);
  EXPECT_EQ(summary.changes[1].what, "program flags");
  EXPECT_EQ(summary.changes[2].what, "program hash");
  // Therefore they have no tolerance.
  records::TrialRecord other = records::read_trials(folder_ / "a")[0];
  const std::string before = records::to_lines(other);
  other.steps[1].measured += 1e-9;
  change("a/trials/0000.jsonl", before, records::to_lines(other));
  EXPECT_EQ(check("a").differences.size(), 1U);
}

TEST_F(VerifyTest, ToleratesThisCpuPluginsOnlyOnAnotherProcessor) {
  const PreparedPlan plan = prepared(suite_text(R"("toy-stumbler")"));
  run(plan, options("a"));
  records::TrialRecord other = records::read_trials(folder_ / "a")[0];
  const std::string before = records::to_lines(other);
  other.steps[1].measured += 1e-9;
  change("a/trials/0000.jsonl", before, records::to_lines(other));
  EXPECT_EQ(check("a").differences.size(), 1U);
  // Other instruction sets mean another processor, another name does not.
  edit_manifest([](Json& manifest) { manifest["machine"]["cpu"] = "Abacus"; });
  EXPECT_EQ(check("a").differences.size(), 1U);
  EXPECT_THAT(check("a").changes, IsEmpty());
  edit_manifest([](Json& manifest) { manifest["machine"]["instruction_sets"] = "abacus: beads"; });
  ASSERT_EQ(check("a").changes.size(), 1U);
  EXPECT_EQ(check("a").changes[0].what, "CPU's instruction sets");
  const VerifySummary summary = check("a");
  EXPECT_TRUE(summary.all_equal());
  EXPECT_EQ(summary.with_tolerance, 1U);
  EXPECT_NEAR(summary.largest_deviation, 1e-9 / (1 + other.steps[1].measured), 1e-14);
}

TEST_F(VerifyTest, SampleCoversAlgorithmsAndDependsOnlyOnItsSeed) {
  run(prepared(suite_text(kWalkers)), options("a"));
  std::map<std::string, std::string> algorithm;
  for (const records::TrialRecord& record : records::read_trials(folder_ / "a"))
    algorithm[record.trial] = record.algorithm;
  const auto sample = [&](std::size_t count, std::uint64_t seed) {
    VerifyOptions options = verify_options("a");
    options.sample = count;
    options.seed = seed;
    VerifySummary summary;
    std::vector<std::string> ids;
    const records::Manifest manifest = records::manifest_of(folder_ / "a");
    records::FolderChecks checks(manifest, folder_ / "a");
    for (const ChosenTrial& trial : choose_trials(options, manifest, summary, checks)) ids.push_back(trial.id);
    return ids;
  };
  std::map<std::string, int> counts;
  for (const std::string& id : sample(6, 1)) ++counts[algorithm.at(id)];
  EXPECT_THAT(counts, testing::UnorderedElementsAre(testing::Pair("toy-walker", 2), testing::Pair("toy-stumbler", 2),
                                                    testing::Pair("short-walker", 2)));
  EXPECT_EQ(sample(6, 1), sample(6, 1));
  EXPECT_NE(sample(6, 1), sample(6, 2));
  EXPECT_EQ(sample(1000, 1).size(), 36U);
}

TEST_F(VerifyTest, CountsStationsAndCrashesWithoutReplay) {
  run(prepared(suite_text(R"("toy-walker")")), options("a"));
  records::TrialRecord lost = records::read_trials(folder_ / "a")[0];
  const std::string before = records::to_lines(lost);
  lost.end = "timeout";
  change("a/trials/0000.jsonl", before, records::to_lines(lost));
  VerifySummary summary = check("a");
  EXPECT_EQ(summary.ended_by_machine, 1U);
  EXPECT_EQ(summary.equal, 11U);
}

// Otherwise nothing would be replayed.
TEST_F(VerifyTest, RefusesStationsThatKnowTheirErrors) {
  run(prepared(suite_text(R"("toy-walker")")), options("a"));
  edit_manifest([](Json& manifest) { manifest["scenes"][0]["owns_stage"] = true; });
  const VerifySummary summary = check("a");
  EXPECT_FALSE(summary.all_equal());
  EXPECT_THAT(records::findings_of(summary.checks),
              testing::Contains(HasSubstr("has 'commanded_mse' at step 0, but its scene has no ground truth")));
}

TEST_F(VerifyTest, ReplaysOneTrialWithItsFrames) {
  run(prepared(suite_text(R"("toy-walker")")), options("a"));
  const std::string id = records::read_trials(folder_ / "a")[3].trial;
  VerifyOptions one = verify_options("a");
  one.trial = id;
  std::vector<unsigned> steps;
  one.on_step = [&](const trials::SceneFacts&, const trials::Step& step, const float* pixels) {
    EXPECT_NE(pixels, nullptr);
    steps.push_back(step.step);
  };
  plugin_host::Catalog catalog = toys();
  EXPECT_EQ(verify(one, catalog).equal, 1U);
  EXPECT_THAT(steps, testing::ElementsAre(0, 1, 2, 3, 4, 5));
  one.trial = "nowhere";
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { verify(one, catalog); }), HasSubstr("no complete trial"));
}

TEST_F(VerifyTest, RefusesAManifestThatHidesTrials) {
  run(prepared(suite_text(R"("toy-walker")")), options("a"));
  edit_manifest([](Json& manifest) {
    manifest["order"].erase(0);
    manifest["trials"] = manifest["order"].size();
  });
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { check("a"); }),
              testing::AllOf(HasSubstr("the suite plans 12 trials"), HasSubstr("but 'order' has 11")));
}

TEST_F(VerifyTest, AcceptsAShardWithAllItsTrials) {
  const PreparedPlan plan = prepared(suite_text(R"("toy-walker")"));
  run(plan, options("a"));
  edit_manifest([&plan](Json& manifest) {
    manifest["order"] = Json::array();
    for (const std::size_t place : places_of_shard(plan.plan, 0, 2))
      manifest["order"].push_back(plan.plan.trials[place].id);
    manifest["trials"] = manifest["order"].size();
    manifest["shard"] = json_of(records::Shard{0, 2, "", manifest["trials"]});
  });
  EXPECT_TRUE(check("a").differences.empty());
  // As one of merged folders, of which the other is missing.
  edit_manifest([](Json& manifest) {
    records::MergeSource source;
    source.folder = "a";
    source.shard = read_described<records::Shard>(manifest["shard"], "shard");
    manifest["sources"] = Json::array({json_of(source)});
    manifest.erase("shard");
  });
  EXPECT_TRUE(check("a").differences.empty());
  for (const auto& [key, value] : {std::pair("number", 2), std::pair("of", 1000)}) {
    edit_manifest([key = key, value = value](Json& manifest) { manifest["sources"][0]["shard"][key] = value; });
    EXPECT_THAT(error_text(ErrorKind::bad_input, [this] { check("a"); }), HasSubstr("but 'order' has 6"));
  }
}

TEST_F(VerifyTest, RefusesAnotherAnalysisPlan) {
  run(prepared(suite_text(R"("toy-walker")", R"(, "analysis": {"rule": "own"})")), options("a"));
  EXPECT_TRUE(check("a").differences.empty());
  edit_manifest([](Json& manifest) {
    manifest["analysis"]["smallest_relevant_ratio"] = 3.0;
    manifest["analysis_hash"] = sha256_hex(canonical_json(manifest["analysis"]));
  });
  EXPECT_THAT(error_text(ErrorKind::bad_input, [this] { check("a"); }), HasSubstr("the analysis plan is"));
}

TEST_F(VerifyTest, CountsPlannedTrialsWithoutRecord) {
  run(prepared(suite_text(R"("toy-walker")")), options("a"));
  std::vector<records::TrialRecord> kept = records::read_trials(folder_ / "a");
  kept.pop_back();
  std::string text;
  for (const records::TrialRecord& record : kept) text += records::with_checksum(records::to_lines(record)) + "\n";
  for (const auto& file : std::filesystem::directory_iterator(folder_ / "a/trials")) std::filesystem::remove(file);
  write_file_atomically(folder_ / "a/trials/0000.jsonl", text);
  const VerifySummary summary = check("a");
  EXPECT_EQ(summary.recorded, 11U);
  EXPECT_EQ(summary.missing, 1U);
}

TEST_F(VerifyTest, RefusesOtherObservationsAndInstanceSet) {
  run(prepared(suite_text(R"("toy-walker")")), options("a"));
  const Json honest = records::read_manifest_json(folder_ / "a");
  edit_manifest([](Json& manifest) { manifest["algorithms"][0]["observes"] = {"design"}; });
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { check("a"); }),
              HasSubstr("observes [\"design\"] by the manifest"));
  edit_manifest([&](Json& manifest) {
    manifest = honest;
    manifest["instance_set"] = "0000000000000000";
  });
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { check("a"); }),
              HasSubstr("'instance_set' is '0000000000000000', but that of the suite is"));
}

// Trial ids are hashes of all this.
TEST_F(VerifyTest, RefusesOtherDescriptionsOfTheSameTrials) {
  run(prepared(suite_text(R"("toy-walker", "toy-stumbler")")), options("a"));
  const Json honest = records::read_manifest_json(folder_ / "a");
  const auto refusal = [&](const std::function<void(Json&)>& edit) {
    edit_manifest([&](Json& manifest) {
      manifest = honest;
      edit(manifest);
    });
    return error_text(ErrorKind::bad_input, [&] { check("a"); });
  };
  EXPECT_THAT(refusal([](Json& manifest) { manifest["algorithms"][0]["parameters"]["stride"] = 2; }),
              HasSubstr("'parameters' of the algorithm 'toy-walker' is {\"stride\":2} in the manifest, but {} by its"));
  EXPECT_THAT(refusal([](Json& manifest) { manifest["scenes"][0]["parameters"]["tells_mtf"] = true; }),
              HasSubstr("'parameters' of the scene 'toy-scene' is"));
  EXPECT_THAT(refusal([](Json& manifest) { manifest["noise_levels"][1]["plugin"] = "none"; }),
              HasSubstr("'plugin' of the noise level 'toy-wild' is \"none\" in the manifest, but \"toy-level\""));
  EXPECT_THAT(refusal([](Json& manifest) {
                manifest["scenes"][0]["spec"] = {{"rmse", 0.5}};
              }),
              HasSubstr("'spec' of the scene 'toy-scene' is {\"rmse\":0.5}"));
  EXPECT_THAT(refusal([](Json& manifest) { manifest["scenes"][0]["truth"] = false; }),
              HasSubstr("'truth' of the scene 'toy-scene' is false"));
  EXPECT_THAT(refusal([](Json& manifest) { manifest["scenes"][0]["machine_time"]["settle_ms"] = 1; }),
              HasSubstr("'machine_time/settle_ms' of the scene 'toy-scene' is 1"));
  EXPECT_THAT(refusal([](Json& manifest) { manifest["algorithms"][0]["added"] = true; }),
              HasSubstr("the suite has 2 'algorithms', the manifest 1"));
  EXPECT_THAT(refusal([](Json& manifest) {
                manifest["algorithms"][0]["of_list"] = {{"method", "best"}, {"training", "one"}};
              }),
              HasSubstr("'of_list' of 'toy-walker'"));
  EXPECT_THAT(refusal([](Json& manifest) { std::swap(manifest["algorithms"][0], manifest["algorithms"][1]); }),
              HasSubstr("the manifest has the methods in another order than the suite"));
  EXPECT_THAT(refusal([](Json& manifest) {
                manifest["algorithms"].push_back(manifest["algorithms"][0]);
                manifest["algorithms"][2]["name"] = "invented";
              }),
              HasSubstr("the manifest has the method 'invented' (protocol paper), the suite does not"));
  EXPECT_THAT(refusal([](Json& manifest) { manifest["limits"] = "hard"; }),
              HasSubstr("'limits' is \"soft\" in the suite and \"hard\" in the manifest"));
  EXPECT_THAT(refusal([](Json& manifest) { manifest["targets"] = {0.5}; }), HasSubstr("'targets' is [] in the suite"));
}

TEST_F(VerifyTest, NamesOtherBuildsOfPluginsInTheManifest) {
  run(prepared(suite_text(R"("toy-walker")")), options("a"));
  const std::string own = records::read_manifest_json(folder_ / "a")["algorithms"][0]["plugin_hash"];
  edit_manifest([](Json& manifest) { manifest["algorithms"][0]["plugin_hash"] = std::string(64, 'b'); });
  const VerifySummary summary = check("a");
  EXPECT_TRUE(summary.all_equal()) << "replays decide";
  ASSERT_EQ(summary.changes.size(), 1U);
  EXPECT_EQ(summary.changes[0].what, "plugin toy-walker");
  EXPECT_EQ(summary.changes[0].was, std::string(16, 'b'));
  EXPECT_EQ(summary.changes[0].is, own.substr(0, 16));
}

TEST_F(VerifyTest, ReportsUnknownTrialsOfAChangedSuite) {
  run(prepared(suite_text(R"("toy-walker")")), options("a"));
  edit_manifest([](Json& manifest) {
    manifest["suite"] = suite_text(R"("toy-walker")", R"(, "seed": 2)");
    manifest["seed"] = 2;
  });
  const VerifySummary summary = check("a");
  EXPECT_EQ(summary.unknown, 12U);
  EXPECT_FALSE(summary.all_equal());
  edit_manifest([](Json& manifest) { manifest["suite"] = "{}"; });
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { check("a"); }),
              HasSubstr("cannot read the suite of these results"));
  edit_manifest([](Json& manifest) { manifest["suite_file"] = "gone/toy.json"; });
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { check("a"); }), HasSubstr("there is no folder gone;"));
}

}  // namespace
}  // namespace relign::runner
