// Pretraining of algorithms: on which instances, once, reproducibly, and the data that trials load.
#include "runner/pretraining.h"

#include <fstream>

#include "base/hash.h"
#include "base/seeds.h"
#include "runner/pretraining_store.h"
#include "toy_suites.h"

namespace relign::runner {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class PretrainingTest : public ToyTest {
 protected:
  PreparedPlan plan(const std::string& algorithms, const std::string& more = "") {
    plugin_host::Catalog catalog;
    for (const char* plugin : {"toy_scene", "toy_level", "toy_walker", "toy_learner"})
      catalog.add(fs::path(RELIGN_RUNNER_TEST_PLUGINS) / plugin);
    return prepare(suites::read_suite(JsonSource::from_text(suite_text(algorithms, more), "toy.json"), ".", catalog),
                   {});
  }
  RunOptions with_cache(const std::string& name) {
    RunOptions given = options(name);
    given.cache_folder = folder_ / "cache";
    return given;
  }
  RunOptions in_processes(const std::string& name) {
    RunOptions given = options(name);
    given.worker_program = {RELIGN_PROGRAM, "worker"};
    return given;
  }
  Pretrainer pretrainer(bool again = false) {
    Pretrainer::Options given;
    given.cache_folder = folder_ / "cache";
    given.on_message = [this](const std::string& message) { messages_.push_back(message); };
    given.again = again;
    return Pretrainer(std::move(given));
  }
  PretrainingEntry only_entry(Pretrainer& pretrainer, const PreparedPlan& of, std::size_t trial = 0) {
    const Pretrainer::Entries& entries =
        pretrainer.prepare(make_job(of, of.plan.trials.at(trial)), of.scene_identity.at(0));
    EXPECT_THAT(entries, SizeIs(1));
    return entries.empty() ? PretrainingEntry() : entries.begin()->second;
  }
};

TEST_F(PretrainingTest, RunsOnceAndReproducesLostData) {
  const PreparedPlan of = plan(R"("toy-learner")");
  Pretrainer first = pretrainer();
  const PretrainingEntry made = only_entry(first, of);
  EXPECT_TRUE(made.made_now);
  EXPECT_EQ(made.sources, 2U);
  EXPECT_EQ(made.steps, 3U);
  ASSERT_TRUE(made.data.bytes) << made.data.failure;
  EXPECT_THAT(*made.data.bytes, HasSubstr("nothing; source 0 of 2"));
  EXPECT_THAT(*made.data.bytes, HasSubstr("; source 1 of 2")) << "the second source starts with the data of the first";
  EXPECT_EQ(made.data.hash, sha256_hex(*made.data.bytes));
  EXPECT_THAT(messages_,
              ElementsAre(HasSubstr("pretraining toy-learner for toy-scene, toy-level, paper: 2 sources of 3")));
  only_entry(first, of, 1);
  EXPECT_THAT(messages_, SizeIs(1)) << "another instance needs no pretraining";

  Pretrainer second = pretrainer();
  EXPECT_FALSE(only_entry(second, of).made_now);
  EXPECT_EQ(only_entry(second, of).data.hash, made.data.hash);
  EXPECT_THAT(messages_, SizeIs(1));
  fs::remove_all(folder_ / "cache");
  Pretrainer third = pretrainer();
  EXPECT_TRUE(only_entry(third, of).made_now);
  EXPECT_EQ(only_entry(third, of).data.hash, made.data.hash) << "lost data are reproduced";
  Pretrainer fourth = pretrainer(true);
  EXPECT_TRUE(only_entry(fourth, of).made_now);
}

TEST_F(PretrainingTest, DependsOnLevelProtocolAndParametersButNotOnTheSuiteSeed) {
  const PreparedPlan of = plan(
      R"("toy-learner", {"use": "toy-learner", "name": "blind", "protocol": "blind"},
         {"use": "toy-learner", "name": "more", "parameters": {"sources": 3}}, {"use": "toy-learner", "name": "again"})");
  Pretrainer all = pretrainer();
  std::map<std::string, std::string> files;
  for (const suites::PlannedTrial& trial : of.plan.trials) {
    if (of.plan.suite.algorithms[trial.algorithm].added || trial.instance > 0) continue;
    const auto& entries = all.prepare(make_job(of, trial), of.scene_identity[0]);
    ASSERT_THAT(entries, SizeIs(1));
    files[of.plan.suite.levels[trial.level].name + " " + of.plan.suite.algorithms[trial.algorithm].name] =
        entries.begin()->second.file.filename().string();
  }
  ASSERT_THAT(files, SizeIs(8));
  EXPECT_EQ(files["toy-level toy-learner"], files["toy-level again"]) << "independent of the name in a suite";
  std::set<std::string> different;
  for (const auto& [what, file] : files) different.insert(file);
  EXPECT_THAT(different, SizeIs(6));

  const PreparedPlan other_seed = plan(R"("toy-learner")", R"(, "seed": 5)");
  Pretrainer other = pretrainer();
  EXPECT_EQ(only_entry(other, other_seed).file.filename(), files["toy-level toy-learner"]);
}

// No source has the seed of an instance, or its draw. All seeds are first halves of one bijection of (domain, number)
// under a key, so that within a suite different inputs give different blocks; checked here for a large sample.
TEST_F(PretrainingTest, UsesNoBenchmarkInstanceAsSource) {
  std::set<std::uint64_t> sources;
  for (std::uint64_t number = 0; number < 1000; ++number)
    sources.insert(instance_seed(0, SeedDomain::pretraining, number));
  EXPECT_THAT(sources, SizeIs(1000));
  for (const std::uint64_t suite_seed : {0, 1, 2, 5, 42})
    for (std::uint64_t number = 0; number < 200000; ++number)
      ASSERT_EQ(sources.count(instance_seed(suite_seed, SeedDomain::benchmark, number)), 0U)
          << suite_seed << " " << number;

  // The runner uses the seeds of that domain.
  const PreparedPlan of = plan(R"("toy-learner")");
  TrialRunner runner({1, {}, {}});
  TrialJob job = make_job(of, of.plan.trials[0]);
  job.seeds = {0, 0};
  trials::PretrainingState state;
  state.sources = 1;
  for (std::uint64_t number = 0; number < 4; ++number) {
    job.instance = number;
    job.pretraining = nullptr;
    const trials::Instance trial = runner.place(job).instance;
    job.pretraining = &state;
    const trials::Instance source = runner.place(job).instance;
    EXPECT_EQ(source.seed, instance_seed(0, SeedDomain::pretraining, number));
    EXPECT_NE(source.seed, trial.seed);
    EXPECT_NE(source.perturbations.start, trial.perturbations.start);
  }
}

TEST_F(PretrainingTest, ReplacesDamagedAndForeignFiles) {
  const PreparedPlan of = plan(R"("toy-learner")");
  Pretrainer first = pretrainer();
  const PretrainingEntry made = only_entry(first, of);
  fs::path sidecar = made.file;
  sidecar.replace_extension(".json");
  const std::string good = read_file(sidecar);
  const auto spoil = [&](const fs::path& file, const std::string& text, const char* sentence) {
    std::ofstream(file) << text;
    messages_.clear();
    Pretrainer next = pretrainer();
    const PretrainingEntry entry = only_entry(next, of);
    EXPECT_TRUE(entry.made_now) << sentence;
    EXPECT_EQ(entry.data.hash, made.data.hash);
    EXPECT_THAT(messages_, Contains(HasSubstr(sentence)));
    EXPECT_EQ(read_file(made.file), *made.data.bytes);
  };
  spoil(made.file, "malformed", "is damaged; repeating the pretraining");
  spoil(sidecar, "{", "is not a JSON object");
  spoil(sidecar, R"({"format": 99})", "has another format");
  Json foreign = Json::parse(good);
  foreign["key"]["protocol"] = "blind";
  spoil(sidecar, foreign.dump(), "has another key");
  fs::remove(sidecar);
  spoil(made.file, *made.data.bytes, ".json");
}

TEST_F(PretrainingTest, WorksWithoutACache) {
  const PreparedPlan of = plan(R"("toy-learner")");
  Pretrainer nothing_kept{Pretrainer::Options{}};
  const PretrainingEntry entry = only_entry(nothing_kept, of);
  EXPECT_TRUE(entry.data.bytes);
  EXPECT_TRUE(entry.file.empty());
}

TEST_F(PretrainingTest, TrialsLoadTheDataAndRecordTheirHash) {
  const PreparedPlan of = plan(R"("toy-learner")");
  run(of, with_cache("a"));
  EXPECT_THAT(messages_, Contains(HasSubstr("pretraining toy-learner for toy-scene, toy-level")));
  Pretrainer known = pretrainer();
  const std::string hash = only_entry(known, of).data.hash;
  const Json manifest = Json::parse(read_file(folder_ / "a/manifest.json"));
  ASSERT_THAT(manifest.at("prepared"), SizeIs(2)) << "two levels";
  EXPECT_EQ(manifest.at("prepared").at(0).at("sha256"), hash);
  EXPECT_EQ(manifest.at("prepared").at(0).at("noise_level"), "toy-level");
  const std::string log = read_file(folder_ / "a/logs" / (of.plan.trials[0].id + ".txt"));
  EXPECT_THAT(log, HasSubstr("loaded nothing; source 0 of 2"));
  EXPECT_THAT(read_file(folder_ / "a/times/0000.jsonl"), HasSubstr(R"("prepared":")" + hash + "\""));

  // A second run changes nothing: no pretraining, no trials, equal files. A run into another folder with an empty cache
  // writes the same.
  messages_.clear();
  const auto before = contents("a");
  EXPECT_EQ(run(of, with_cache("a")).reused, of.plan.trials.size());
  EXPECT_THAT(messages_, IsEmpty());
  EXPECT_EQ(contents("a"), before);
  fs::remove_all(folder_ / "cache");
  run(of, with_cache("b"));
  EXPECT_EQ(contents("b"), before);
}

TEST_F(PretrainingTest, RunsTrialsAgainAfterTheDataChanged) {
  const PreparedPlan of = plan(R"("toy-learner")");
  run(of, with_cache("a"));
  // Simulates data from another machine, with different last digits.
  Pretrainer known = pretrainer();
  const PretrainingEntry entry = only_entry(known, of);
  fs::path sidecar = entry.file;
  sidecar.replace_extension(".json");
  Json told = Json::parse(read_file(sidecar));
  told["sha256"] = sha256_hex("other");
  std::ofstream(sidecar) << told.dump();
  std::ofstream(entry.file) << "other";
  messages_.clear();
  const RunSummary summary = run(of, with_cache("a"));
  EXPECT_THAT(messages_, Contains("pretrained data of toy-learner changed: 6 trials run again"));
  EXPECT_EQ(summary.reused, of.plan.trials.size() - 6);
}

TEST_F(PretrainingTest, FailureFailsTheTrialsWithItsReason) {
  const PreparedPlan of = plan(R"({"use": "toy-learner", "name": "trips", "parameters": {"trips_on": 1}},
                                  {"use": "toy-learner", "name": "forgets", "parameters": {"forgets": true}})");
  const RunSummary summary = run(of, with_cache("a"));
  EXPECT_EQ(summary.failed, 24U);
  EXPECT_THAT(summary.failures.at(0), HasSubstr("pretraining toy-learner failed on source 1"));
  EXPECT_THAT(summary.failures.at(0), HasSubstr("tripped"));
  EXPECT_THAT(summary.failures, Contains(HasSubstr("it saved no data on any source")));
  EXPECT_FALSE(fs::exists(folder_ / "cache/prepared/toy-learner")) << "incomplete data are not stored";
}

TEST_F(PretrainingTest, IsTheSameInAWorkerProcess) {
  const PreparedPlan of = plan(R"("toy-learner", "toy-walker")");
  run(of, options("thread"));
  RunOptions process = in_processes("process");
  run(of, process);
  EXPECT_EQ(contents("process"), contents("thread"));
  EXPECT_FALSE(fs::exists(folder_ / "cache"));
  process.results = folder_ / "kept";
  process.cache_folder = folder_ / "cache";
  run(of, process);
  EXPECT_EQ(contents("kept"), contents("thread"));
  EXPECT_TRUE(fs::exists(folder_ / "cache/prepared/toy-learner"));
}

TEST_F(PretrainingTest, AcceptsLargeDataFromAWorkerProcess) {
  const PreparedPlan of =
      plan(R"({"use": "toy-learner", "name": "collects", "parameters": {"bytes": 3000000, "sources": 1}})");
  EXPECT_EQ(run(of, in_processes("process")).failed, 0U);
  run(of, options("thread"));
  EXPECT_EQ(contents("process"), contents("thread"));
}

TEST_F(PretrainingTest, CrashFailsOnlyTheAlgorithmsTrials) {
  ::setenv("ASAN_OPTIONS", "handle_abort=0", 1);
  const PreparedPlan of = plan(R"({"use": "toy-learner", "name": "crashes", "parameters": {"crashes_on": 1}},
                                  "toy-walker", "toy-learner")");
  const RunSummary summary = run(of, in_processes("a"));
  EXPECT_EQ(summary.finished, of.plan.trials.size());
  EXPECT_EQ(summary.failed, 12U);
  EXPECT_THAT(summary.failures.at(0),
              HasSubstr("pretraining toy-learner failed: crashed(SIGABRT), its worker was killed by SIGABRT"));
  for (const records::TrialRecord& trial : records::read_trials(folder_ / "a"))
    EXPECT_EQ(records::ended_well(trial.end), trial.algorithm != "crashes") << trial.message;
}

TEST_F(PretrainingTest, LimitsTheTimeOfASource) {
  const PreparedPlan of =
      plan(R"({"use": "toy-learner", "name": "hangs", "parameters": {"hangs_on": 1}}, "toy-walker")",
           R"(, "trial_seconds": 0.5)");
  const RunSummary summary = run(of, in_processes("a"));
  EXPECT_EQ(summary.finished, of.plan.trials.size());
  EXPECT_EQ(summary.failed, 12U);
  EXPECT_THAT(summary.failures.at(0), HasSubstr("timeout, one source took longer than 0.5 s"));
}

TEST_F(PretrainingTest, StoresNothingAfterAStop) {
  const PreparedPlan of = plan(R"("toy-learner")");
  const std::atomic<bool> stop{true};
  Pretrainer::Options given;
  given.cache_folder = folder_ / "cache";
  given.stop = &stop;
  Pretrainer stopped(std::move(given));
  test::error_text(ErrorKind::stopped, [&] { stopped.prepare(make_job(of, of.plan.trials[0]), of.scene_identity[0]); });
  EXPECT_FALSE(fs::exists(folder_ / "cache/prepared/toy-learner"));
  RunOptions run_options = with_cache("a");
  run_options.stop = &stop;
  EXPECT_TRUE(run(of, run_options).stopped);
}

}  // namespace
}  // namespace relign::runner
