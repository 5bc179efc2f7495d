#include "suites/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <set>

namespace relign::suites {
namespace {

plugin_host::Choice choice(const std::string& id, const std::string& identity) {
  plugin_host::Choice made;
  made.plugin = std::make_shared<plugin_host::Manifest>();
  made.id = id;
  made.identity = identity;
  return made;
}

Suite small_suite() {
  Suite suite;
  suite.name = "small";
  suite.instances = 3;
  suite.scenes = {{"toy", choice("toy", R"({"kind":"scene","parameters":{"white":0.5},"plugin":"toy"})")}};
  suite.levels = {{"calm", choice("calm", R"({"kind":"noise-level","parameters":{},"plugin":"calm"})")},
                  {"wild", choice("wild", R"({"kind":"noise-level","parameters":{"width":2},"plugin":"calm"})")}};
  AlgorithmEntry walker;
  walker.name = "walker";
  walker.choice = choice("walker", R"({"kind":"optimizer","parameters":{},"plugin":"walker"})");
  walker.protocol = "paper";
  walker.steps = 5;
  AlgorithmEntry jumper = walker;
  jumper.name = "jumper";
  suite.algorithms = {walker, jumper};
  return suite;
}

const std::vector<std::string> kData = {R"({"files":[{"name":"lens.json","sha256":"00"}]})"};

TEST(Plan, OrdersBySceneLevelAlgorithmInstance) {
  const Plan plan = make_plan(small_suite(), kData);
  ASSERT_EQ(plan.trials.size(), 12U);
  EXPECT_EQ(plan.trials[0].instance, 0U);
  EXPECT_EQ(plan.trials[2].instance, 2U);
  EXPECT_EQ(plan.trials[3].algorithm, 1U);
  EXPECT_EQ(plan.trials[6].level, 1U);
  std::set<std::string> ids;
  for (const PlannedTrial& trial : plan.trials) {
    ids.insert(trial.id);
    EXPECT_EQ(trial.id.size(), 16U);
    EXPECT_EQ(trial.id.find_first_not_of("0123456789abcdef"), std::string::npos);
  }
  EXPECT_EQ(ids.size(), 12U);
}

// Frozen: published results are identified by these ids. If this fails, the change breaks resuming
// and merging of all existing folders.
TEST(Plan, IdsAreFrozen) {
  const Plan plan = make_plan(small_suite(), kData);
  EXPECT_EQ(plan.trials.front().id, "ae3a7d8a9967afa4");
  EXPECT_EQ(plan.trials.back().id, "b479c439fb16f3aa");
  EXPECT_EQ(plan.instance_set, "8f7f082b7abc1e08");
}

TEST(Plan, IdsDoNotDependOnOtherTrials) {
  const Plan whole = make_plan(small_suite(), kData);
  Suite suite = small_suite();
  suite.algorithms.erase(suite.algorithms.begin());
  suite.levels.erase(suite.levels.begin());
  suite.first_instance = 2;
  suite.instances = 1;
  suite.name = "other";
  suite.text = "{}";
  const Plan part = make_plan(suite, kData);
  ASSERT_EQ(part.trials.size(), 1U);
  EXPECT_EQ(part.trials[0].id, whole.trials.back().id);
}

TEST(Plan, IdsDoNotDependOnNamesOfScenesAndLevels) {
  Suite suite = small_suite();
  suite.scenes[0].name = "my toy";
  suite.levels[0].name = "quiet";
  EXPECT_EQ(make_plan(suite, kData).trials[0].id, make_plan(small_suite(), kData).trials[0].id);
}

TEST(Plan, DefaultMeritEqualsNamingIt) {
  Suite suite = small_suite();
  suite.algorithms[0].merit = "combined";
  EXPECT_EQ(make_plan(suite, kData).trials[0].id, make_plan(small_suite(), kData).trials[0].id);
}

TEST(Plan, IdsDependOnLimitsOnlyWhereTheMeritIsMadeOfThem) {
  const auto id = [](const char* merit, double corner) {
    Suite suite = small_suite();
    suite.algorithms[0].merit = merit;
    suite.spec = {{"mtf", {{"lp_per_mm", 20}, {"corner", corner}}}};
    return make_plan(suite, kData).trials[0].id;
  };
  EXPECT_NE(id("mtf", 0.3), id("mtf", 0.4));
  EXPECT_EQ(id("rmse", 0.3), id("rmse", 0.4));
  EXPECT_EQ(id("edge_energy", 0.3), id("edge_energy", 0.4));
  EXPECT_NE(id("mtf", 0.3), id("edge_energy", 0.3));
}

TEST(Plan, IdsDependOnEverythingThatDeterminesTheResult) {
  const Plan base = make_plan(small_suite(), kData);
  const std::vector<std::pair<const char*, std::function<void(Suite&)>>> changes = {
      {"scene", [](Suite& s) { s.scenes[0].choice.identity = R"({"kind":"scene","parameters":{"white":0.6}})"; }},
      {"level", [](Suite& s) { s.levels[0].choice.identity = R"({"kind":"noise-level","plugin":"rho"})"; }},
      {"seed", [](Suite& s) { s.seed = 2; }},
      {"instance", [](Suite& s) { s.first_instance = 100; }},
      {"protocol", [](Suite& s) { s.algorithms[0].protocol = "blind"; }},
      {"merit", [](Suite& s) { s.algorithms[0].merit = "rmse"; }},
      {"budget", [](Suite& s) { s.algorithms[0].steps = 6; }},
      {"limits", [](Suite& s) { s.limits = "hard"; }},
      {"measured MTF",
       [](Suite& s) {
         s.spec = {{"mtf", {{"lp_per_mm", 20}}}};
       }},
      {"another MTF",
       [](Suite& s) {
         s.spec = {{"mtf", {{"lp_per_mm", 40}}}};
       }},
      {"machine time", [](Suite& s) { s.machine_time.settle_ms = 41; }},
      {"another machine time", [](Suite& s) { s.machine_time.exposure_ms = 41; }},
      {"algorithm", [](Suite& s) { s.algorithms[0].choice.identity = R"({"kind":"optimizer","plugin":"x"})"; }},
      {"label", [](Suite& s) { s.algorithms[0].name = "our-walker"; }},
  };
  std::set<std::string> ids = {base.trials[0].id};
  for (const auto& [what, change] : changes) {
    Suite suite = small_suite();
    change(suite);
    EXPECT_TRUE(ids.insert(make_plan(suite, kData).trials[0].id).second) << what;
  }
  EXPECT_TRUE(
      ids.insert(make_plan(small_suite(), {R"({"files":[{"name":"lens.json","sha256":"01"}]})"}).trials[0].id).second)
      << "data files";
}

// The limits may change after trials have run.
TEST(Plan, IdsDoNotDependOnLimitsOfTheSpecification) {
  const auto id = [](const Json& spec) {
    Suite suite = small_suite();
    suite.spec = spec;
    return make_plan(suite, kData).trials[0].id;
  };
  EXPECT_EQ(id({{"rmse", 0.01}}), id(nullptr));
  EXPECT_EQ(id({{"rmse", 0.02}, {"mtf", {{"lp_per_mm", 20}, {"centre", 0.5}}}}),
            id({{"mtf", {{"lp_per_mm", 20}, {"corner", 0.3}}}}));
}

TEST(Plan, InstanceSetDependsOnInstancesOnly) {
  const std::string base = make_plan(small_suite(), kData).instance_set;
  Suite suite = small_suite();
  suite.algorithms.pop_back();
  suite.algorithms[0].steps = 99;
  std::swap(suite.levels[0], suite.levels[1]);
  EXPECT_EQ(make_plan(suite, kData).instance_set, base);
  suite.instances = 4;
  EXPECT_NE(make_plan(suite, kData).instance_set, base);
  suite = small_suite();
  suite.seed = 2;
  EXPECT_NE(make_plan(suite, kData).instance_set, base);
  suite = small_suite();
  suite.levels.pop_back();
  EXPECT_NE(make_plan(suite, kData).instance_set, base);
  EXPECT_NE(make_plan(small_suite(), {"{}"}).instance_set, base);
}

TEST(Plan, NeedsOneIdentityPerScene) { EXPECT_THROW(make_plan(small_suite(), {}), Error); }

}  // namespace
}  // namespace relign::suites
