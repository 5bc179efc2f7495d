// Scene, station and noise level that run as processes, from suite to records: the toys of python_toys/.
#include <cstdlib>
#include <set>

#include "plugin_host/catalog.h"
#include "toy_suites.h"

namespace relign::runner {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

const fs::path kToys = RELIGN_RUNNER_TEST_PLUGINS;
const fs::path kPythonToys = fs::path(RELIGN_SOURCE_DIR) / "tests/harness/runner/python_toys";

class ProcessToysTest : public ToyTest {
 protected:
  void SetUp() override {
    ToyTest::SetUp();
    if (std::system("python3 -c 'import sys; sys.exit(sys.version_info < (3, 9))' >/dev/null 2>&1") != 0)
      GTEST_SKIP() << "python3 (3.9 or later) is not installed";
  }

  static PreparedPlan plan_with(const std::vector<fs::path>& plugins, const std::string& suite) {
    plugin_host::Catalog catalog;
    for (const fs::path& plugin : plugins) catalog.add(plugin);
    return prepare(suites::read_suite(JsonSource::from_text(suite, "toy.json"), ".", catalog), {});
  }

  // Records as text, without members that depend on whether a plugin is a library or a process.
  std::vector<std::string> trials(const std::string& name) const {
    std::vector<std::string> texts;
    for (records::TrialRecord record : records::read_trials(folder_ / name)) {
      record.trial.clear();
      texts.push_back(records::to_lines(record));
    }
    return texts;
  }
};

TEST_F(ProcessToysTest, MatchTheLibrariesForAnyNumberOfWorkers) {
  const std::string suite = suite_text(R"("toy-walker")");
  run(plan_with({kToys / "toy_scene", kToys / "toy_level", kToys / "toy_walker"}, suite), options("libraries"));
  const std::vector<fs::path> python = {kPythonToys / "toy_scene.py", kPythonToys / "toy_level.py",
                                        kToys / "toy_walker"};
  const PreparedPlan plan = plan_with(python, suite);
  ASSERT_EQ(plan.plan.trials.size(), 12U);
  EXPECT_EQ(run(plan, options("1", 1)).failed, 0U);
  EXPECT_EQ(run(plan, options("2", 2)).failed, 0U);
  EXPECT_EQ(trials("1"), trials("libraries"));
  EXPECT_EQ(contents("1"), contents("2"));
}

TEST_F(ProcessToysTest, RestartsAStationThatDies) {
  const std::string suite = R"({"scenes": [{"use": "toy-station", "name": "bench",
      "parameters": {"dies_in_trial": 2}}], "noise_levels": ["none"], "algorithms": ["toy-walker"],
      "instances": 3, "steps": 3})";
  const fs::path ours = RELIGN_PLUGIN_DIR;
  const PreparedPlan plan = plan_with(
      {kPythonToys / "toy_station.py", kToys / "toy_walker", ours / "none", ours / "home", ours / "random"}, suite);
  ASSERT_EQ(plan.plan.trials.size(), 6U);  // toy-walker and random
  const RunSummary summary = run(plan, options("1", 2));
  EXPECT_THAT(messages_, Contains(HasSubstr("a station runs one trial at a time")));
  EXPECT_EQ(summary.finished, 6U);
  EXPECT_EQ(summary.failed, 3U) << "a process completes one trial and dies in the second";
  std::set<std::string> messages;  // each has its process id
  for (const records::TrialRecord& record : records::read_trials(folder_ / "1")) {
    if (records::ended_well(record.end)) {
      EXPECT_EQ(record.steps.size(), 4U);
      EXPECT_DOUBLE_EQ(record.steps[3].machine_seconds, 0.5 + 3 * 0.75);
      continue;
    }
    EXPECT_EQ(record.end, "crashed(exit 9)");
    EXPECT_EQ(record.steps.size(), 2U) << "completed steps are kept";
    EXPECT_THAT(record.message, AllOf(HasSubstr("plugin 'toy-station' failed in move_by"),
                                      HasSubstr("ended with exit status 9"), HasSubstr("lost its reference")));
    messages.insert(record.message);
  }
  EXPECT_EQ(messages.size(), 3U);
}

TEST_F(ProcessToysTest, PretrainedDataMatchTheLibrary) {
  const std::string suite = suite_text(
      R"("toy-learner", {"use": "toy-learner", "name": "collects", "parameters": {"bytes": 3000000, "sources": 1}})");
  const auto learnt = [&](const fs::path& learner, const std::string& name) {
    RunOptions given = options(name, 2);
    given.cache_folder = folder_ / (name + " cache");
    given.worker_program = {RELIGN_PROGRAM, "worker"};
    const RunSummary summary = run(plan_with({kToys / "toy_scene", kToys / "toy_level", learner}, suite), given);
    EXPECT_EQ(summary.failed, 0U) << (summary.failures.empty() ? "" : summary.failures.front());
    std::multiset<std::string> data;
    for (const fs::directory_entry& file : fs::directory_iterator(given.cache_folder / "prepared/toy-learner"))
      if (file.path().extension() == ".data") data.insert(read_file(file.path()));
    return data;
  };
  const std::multiset<std::string> libraries = learnt(kToys / "toy_learner", "libraries");
  ASSERT_EQ(libraries.size(), 4U) << "two algorithms, two levels";
  EXPECT_TRUE(learnt(kPythonToys / "toy_learner.py", "python") == libraries);
  EXPECT_EQ(trials("python"), trials("libraries"));
}

TEST_F(ProcessToysTest, FailedPretrainingFailsTheTrialsWithItsMessage) {
  const RunSummary summary =
      run(plan_with({kToys / "toy_scene", kToys / "toy_level", kPythonToys / "toy_learner.py"},
                    suite_text(R"({"use": "toy-learner", "name": "trips", "parameters": {"trips_on": 1}})")),
          options("trips"));
  EXPECT_EQ(summary.failed, 12U);
  ASSERT_FALSE(summary.failures.empty());
  EXPECT_THAT(summary.failures.front(),
              AllOf(HasSubstr("pretraining toy-learner failed on source 1"), HasSubstr("tripped")));
}

}  // namespace
}  // namespace relign::runner
