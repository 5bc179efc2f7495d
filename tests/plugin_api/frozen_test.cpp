// Plugins of version 1.0 (frozen_1_0) in a host of this tree. Compiled twice: with the header as it is, and in a host
// of a later minor version, whose structs have grown (plugin_api_grown_host).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "plugin_host/objects.h"
#include "trials/trial.h"

#ifdef RELIGN_HOST_HAS_GROWN
static_assert(RELIGN_ABI_MINOR == 77 && sizeof(relign_host) == 120 && sizeof(relign_observation) == 96 &&
                  sizeof(relign_trial) == 104 && sizeof(relign_task) == 112 && sizeof(relign_image) == 80,
              "this is to be a host that has grown");
#endif

namespace relign::trials {
namespace {

using plugin_host::Catalog;
using plugin_host::Choice;
using plugin_host::Kind;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Choice frozen(Kind kind, const std::string& folder) {
  static auto* catalog = new Catalog;
  return catalog->resolve_or_throw(kind, std::string(RELIGN_FROZEN_PLUGINS) + "/" + folder);
}

struct FrozenTrial {
  FrozenTrial(const std::string& scene_folder, const std::string& algorithm_folder)
      : scene_choice(frozen(Kind::scene, scene_folder)),
        scene(scene_choice, logging()),
        level(frozen(Kind::noise_level, "noise_level"), logging()),
        algorithm(frozen(Kind::optimizer, algorithm_folder)),
        facts(read_scene_facts(scene.describe(), scene_folder)) {
    if (!facts.owns_stage) instance = draw_instance(level, facts, 1, SeedDomain::benchmark, 0);
  }
  TrialResult run() {
    if (facts.owns_stage) return run_on(Station{scene});
    plugin_host::MountedAssembly assembly = scene.mount(instance.perturbations.elements_json);
    ModelScene model(scene, scene_choice, logging());
    return run_on(SimulatedLens{assembly, model, level});
  }
  TrialResult run_on(StageSetup stage) {
    return run_trial({.stage = stage,
                      .reference = scene.reference(),
                      .scene = facts,
                      .instance = instance,
                      .algorithm = algorithm,
                      .terms = {.protocol = Protocol::blind, .budget = 10, .machine_time = facts.machine_time},
                      .services = logging()});
  }
  plugin_host::HostServices logging() {
    plugin_host::HostServices services;
    services.log = [this](int, const std::string& line) { log.push_back(line); };
    return services;
  }

  std::vector<std::string> log;
  Choice scene_choice;
  plugin_host::Scene scene;
  plugin_host::NoiseLevel level;
  Choice algorithm;
  SceneFacts facts;
  Instance instance;
};

// By scene.c: sum of the distances from 0.5, the first axis moved by the shift of L1.
double distance(const std::vector<double>& true_pose) {
  return std::fabs(true_pose[0] - 0.53125) + std::fabs(true_pose[1] - 0.5);
}
const double kColumns = std::sqrt((1 + 1.21 + 1.44 + 1.69 + 1.96 + 2.25) / 6);  // root mean square of 1 + c / 10
constexpr double kNoise = 1e-3;

TEST(Frozen, EachIsToldByWhomItIsRun) {
  FrozenTrial trial("scene", "optimizer");
  trial.run();
  const std::string host = "host " + std::to_string(RELIGN_ABI_MAJOR) + "." + std::to_string(RELIGN_ABI_MINOR) +
                           " of " + std::to_string(sizeof(relign_host)) + " bytes";
  EXPECT_EQ(std::count(trial.log.begin(), trial.log.end(), host), 3) << "scene, level and optimizer";
}

TEST(Frozen, AnOptimizerRunsATrialAndHandsOver) {
  FrozenTrial trial("scene", "optimizer");
  const TrialResult result = trial.run();
  EXPECT_EQ(result.message, "");
  EXPECT_EQ(result.end, End::budget_spent);
  EXPECT_THAT(result.environment_changes, IsEmpty());
  EXPECT_THAT(trial.log, Contains("other steps 2 end 1"));  // the agent makes two of its three steps
  ASSERT_EQ(result.steps.size(), 11U);
  EXPECT_GE(result.steps[0].true_pose[0], 0.25);
  EXPECT_EQ(result.steps[0].true_pose[1], 0.75);
  EXPECT_EQ(result.steps[1].true_pose[0], result.steps[0].true_pose[0] + 0.0625);
  EXPECT_EQ(result.steps[2].true_pose[1], 0.6875);
  EXPECT_EQ(result.steps[4].true_pose[1], 0.4375);
  for (const Step& step : result.steps) {
    EXPECT_NEAR(step.measured_rmse, distance(step.true_pose) * kColumns, kNoise) << step.number;
    EXPECT_NEAR(std::sqrt(step.commanded_truth.mse), distance(step.true_pose) * kColumns, 1e-12) << step.number;
  }
  const Step& last = result.steps.back();
  EXPECT_EQ(last.recommendation_source, RecommendationSource::own);
  for (const Step& step : result.steps) EXPECT_LE(last.recommended_truth.mse, step.commanded_truth.mse + kNoise);
}

TEST(Frozen, AnAgentGetsEveryService) {
  FrozenTrial trial("scene", "agent");
  const TrialResult result = trial.run();
  EXPECT_EQ(result.message, "");
  EXPECT_EQ(result.end, End::finished);
  EXPECT_EQ(result.steps.size(), 3U);
  EXPECT_THAT(trial.log, Contains(HasSubstr("reference 0.5000 mean")));
  EXPECT_THAT(trial.log, Contains("prior observes the shift"));
  EXPECT_THAT(trial.log, Contains("model 0.6250"));
}

TEST(Frozen, AStationMovesAndIsCutAtItsLimits) {
  FrozenTrial trial("station", "agent");
  const TrialResult result = trial.run();
  EXPECT_EQ(result.message, "");
  for (const char* service : {"prior", "model"})
    EXPECT_THAT(trial.log, testing::Not(Contains(HasSubstr(service)))) << "a station offers neither";
  ASSERT_EQ(result.steps.size(), 3U);
  EXPECT_DOUBLE_EQ(result.steps[2].machine_seconds, 3 * 0.125 + 2 * 0.5);
  EXPECT_DOUBLE_EQ(result.steps[2].measured_rmse, 1);  // both places together, against a dark reference
  trial.scene.begin(1);
  const auto made = trial.scene.move_by({-0.5, 0.125});
  EXPECT_THAT(made.moved, ElementsAre(-0.25, 0.125));
  EXPECT_EQ(made.limits_low, 1U);
  EXPECT_EQ(made.limits_high, 0U);
}

TEST(Frozen, ASceneRendersWithoutNoise) {
  FrozenTrial trial("scene", "agent");
  std::vector<float> pixels(24);
  ASSERT_TRUE(trial.scene.mount("{}").render_noise_free({0.5, 0.75}, pixels.data()));
  EXPECT_EQ(pixels[0], 0.75F);
}

}  // namespace
}  // namespace relign::trials
