#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/files.h"
#include "plugin_host/catalog.h"
#include "trials/stage.h"
#include "trials/trial.h"

namespace relign::aim_off_tests {
namespace {

using plugin_host::Kind;
using trials::Instance;

// 4 batches of 25 modules on the toy scene, whose optimum is pose 0.5 on every axis, where `home` ends. The cure shift
// of a batch has a standard deviation of 1 % of the travel along x and y, a module's own 0.1 %.
constexpr unsigned kBatches = 4, kSize = 25;
const char* const kLevel = R"({"use": "tolerances", "elements": {},
  "start": {"shift_um": [200, 200, 200, 200], "tilt_arcmin": [60]},
  "cure_shift": {"shift_um": [6, 6, 0, 0], "tilt_arcmin": [0]},
  "batch": {"size": 25, "cure_shift": {"shift_um": [60, 60, 0, 0], "tilt_arcmin": [0]}, "inspection_um": [2, 2, 0, 0]}})";

class AimOff : public testing::Test {
 protected:
  AimOff() {
    catalog_.scan(RELIGN_PLUGIN_DIR);
    scene_choice_ = catalog_.resolve_or_throw(Kind::scene, "gaussian_spot", {{"photons", 0}});
    scene_.emplace(scene_choice_, services_);
    facts_ = trials::facts_of(*scene_, "gaussian_spot");
    const std::string path = testing::TempDir() + "/aim_off_batches.json";
    write_file_atomically(path, kLevel);
    level_.emplace(catalog_.resolve_or_throw(Kind::noise_level, path), services_);
  }

  Instance instance(std::uint64_t number) {
    return trials::draw_instance(*level_, facts_, 1, SeedDomain::benchmark, number);
  }

  trials::Step last_step(const Instance& instance, const std::string& method, const Json& parameters = {}) {
    const trials::TrialResult result = run(instance, method, parameters);
    EXPECT_EQ(result.end, trials::End::finished) << result.message;
    return result.steps.back();
  }

  trials::TrialResult run(const Instance& instance, const std::string& method, const Json& parameters,
                          trials::Protocol protocol = trials::Protocol::paper) {
    plugin_host::MountedAssembly assembly = scene_->mount(instance.perturbations.elements_json);
    trials::ModelScene model(*scene_, scene_choice_, services_);
    const plugin_host::Choice algorithm = catalog_.resolve_or_throw(Kind::optimizer, method, parameters);
    return trials::run_trial({.stage = trials::SimulatedLens{assembly, model, *level_},
                              .reference = scene_->reference(),
                              .scene = facts_,
                              .instance = instance,
                              .algorithm = algorithm,
                              .terms = {.protocol = protocol, .budget = 3, .machine_time = facts_.machine_time},
                              .services = services_});
  }

  plugin_host::Catalog catalog_;
  plugin_host::HostServices services_;
  plugin_host::Choice scene_choice_;
  std::optional<plugin_host::Scene> scene_;
  std::optional<plugin_host::NoiseLevel> level_;
  trials::SceneFacts facts_;
};

TEST_F(AimOff, RaisesTheYieldOfEveryBatchButForItsFirstModules) {
  // In specification: within 0.4 % of the travel after curing, on both axes.
  const auto in_specification = [](const trials::Step& step) {
    return std::hypot(step.recommended_true_pose[0] - 0.5, step.recommended_true_pose[1] - 0.5) < 0.004;
  };
  unsigned before = 0, after = 0;
  for (unsigned number = 0; number < kBatches * kSize; ++number) {
    const Instance module = instance(number);
    const trials::Step home = last_step(module, "home");
    const trials::Step aimed = last_step(module, "aim-off", {{"algorithm", "home"}, {"doubt", 0.05}});
    if (number % kSize == 0) {
      EXPECT_EQ(aimed.recommended_true_pose, home.recommended_true_pose) << "no history";
    }
    before += in_specification(home) ? 1 : 0;
    after += in_specification(aimed) ? 1 : 0;
  }
  EXPECT_LE(before, kBatches * kSize / 4);
  EXPECT_GE(after, kBatches * (kSize - 1) * 95 / 100);
}

TEST_F(AimOff, RecommendsThePosteriorMeanOfTheBatch) {
  const Instance module = instance(10);
  for (const unsigned used : {0u, 1u, 4u, 10u, 50u}) {
    const trials::Step step = last_step(module, "aim-off", {{"algorithm", "home"}, {"modules", used}, {"doubt", 0.5}});
    const unsigned known = std::min(used, 10u);
    double expected = 0;
    for (std::uint32_t back = 1; back <= known; ++back)
      expected += trials::inspected_shift(*level_, facts_, module, back)[1] / (known + 0.5);
    EXPECT_NEAR(step.recommended_pose[1], 0.5 - expected, 1e-12) << used;
    EXPECT_EQ(step.recommended_pose[3], 0.5) << "nothing shifts there";
  }
}

TEST_F(AimOff, RefusesAnOracleThatWouldNotGetTheStart) {
  const trials::TrialResult result = run(instance(0), "aim-off", {{"algorithm", "home"}}, trials::Protocol::blind);
  EXPECT_EQ(result.end, trials::End::failed);
  EXPECT_THAT(result.message, testing::HasSubstr("'home' cannot run inside 'aim-off': it is an oracle"));
}

}  // namespace
}  // namespace relign::aim_off_tests
