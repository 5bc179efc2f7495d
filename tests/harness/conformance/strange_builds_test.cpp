// Plugins with unusual builds do not affect others: built with -ffast-math, whose start-up code sets flush-to-zero in
// the loading thread; with a C++ library of their own; with the old std::string. A scene's pixels and ground truth, and
// every step of a trial, have the same bits before and after such plugins were loaded and run.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "conformance/conduct.h"
#include "conformance/subject.h"
#include "plugin_host/guard.h"
#include "plugin_host/objects.h"
#include "trials/scene_facts.h"

namespace relign::conformance {
namespace {

struct Frame {
  std::vector<float> pixels;
  plugin_host::MountedAssembly::Truth truth{};
};

Frame frame_of(plugin_host::Scene& scene, const std::string& id) {
  const trials::SceneFacts facts = trials::read_scene_facts(scene.describe(), id);
  Frame frame;
  frame.pixels.resize(std::size_t{facts.image_width} * facts.image_height);
  plugin_host::MountedAssembly assembly = scene.mount("{}");
  assembly.capture(facts.nominal_pose, 3, frame.pixels.data());
  frame.truth = assembly.noise_free_mse(facts.nominal_pose, 4);
  return frame;
}

void expect_equal(const Frame& one, const Frame& other) {
  ASSERT_EQ(one.pixels.size(), other.pixels.size());
  EXPECT_EQ(std::memcmp(one.pixels.data(), other.pixels.data(), one.pixels.size() * sizeof(float)), 0);
  EXPECT_EQ(one.truth.mse, other.truth.mse);
  EXPECT_EQ(one.truth.standard_error, other.truth.standard_error);
}

std::vector<FakeTrial::Visit> steps_of(const Subject& subject) {
  FakeSetup setup = setup_for(subject.choice(), 5);
  setup.merit = noisy(setup.merit);
  FakeTrial trial(setup);
  run_trial(subject.choice(), trial);
  return trial.steps;
}

void expect_equal(const std::vector<FakeTrial::Visit>& one, const std::vector<FakeTrial::Visit>& other) {
  ASSERT_GT(one.size(), 10U);
  ASSERT_EQ(one.size(), other.size());
  for (std::size_t step = 0; step < one.size(); ++step) {
    EXPECT_EQ(one[step].pose, other[step].pose) << step;
    EXPECT_EQ(one[step].merit, other[step].merit) << step;
  }
}

TEST(StrangeBuilds, DoNotChangeResultsOfOtherPlugins) {
  const Subject lens = open_subject(std::filesystem::path(RELIGN_PLUGIN_DIR) / "lens_system");
  const Subject search = open_subject(std::filesystem::path(RELIGN_PLUGIN_DIR) / "nlopt");
  const auto state = plugin_host::FloatingPointState::current();
  plugin_host::Scene scene(lens.choice(), {});
  const Frame frame = frame_of(scene, lens.choice().id);
  const auto steps = steps_of(search);

  for (const std::string build : {"fast_math", "own_library", "old_strings"}) {
    SCOPED_TRACE(build);
    const Subject strange = open_subject(std::filesystem::path(RELIGN_SABOTEURS) / build);
    const auto changes = plugin_host::floating_point_changes().count;
    EXPECT_EQ(steps_of(strange).size(), FakeSetup().budget);
    // Confirms that the guard was needed: loading has changed the mode.
    EXPECT_EQ(plugin_host::floating_point_changes().count, changes + (build == "fast_math" ? 1 : 0));
    EXPECT_TRUE(plugin_host::FloatingPointState::current().same_mode(state));
    volatile double smallest = std::numeric_limits<double>::min();
    volatile double subnormal = smallest / 2;
    EXPECT_GT(subnormal, 0.0);

    expect_equal(frame, frame_of(scene, lens.choice().id));
    plugin_host::Scene later(lens.choice(), {});
    expect_equal(frame, frame_of(later, lens.choice().id));
    expect_equal(steps, steps_of(search));
  }
}

}  // namespace
}  // namespace relign::conformance
