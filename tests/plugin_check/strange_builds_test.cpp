// A plugin built with -ffast-math switches subnormal numbers off in the thread that loads it. Nobody
// else may see that: a scene's pixels and truths are the same bits before and after.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "plugin_check/conduct.h"
#include "plugin_check/subject.h"
#include "plugin_host/guard.h"
#include "plugin_host/objects.h"
#include "task/scene_facts.h"

namespace relign::plugin_check {
namespace {

struct Frame {
  std::vector<float> pixels;
  plugin_host::MountedAssembly::Truth truth{};
};

Frame frame_of(plugin_host::Scene& scene, const std::string& id) {
  const task::SceneFacts facts = task::read_scene_facts(scene.describe(), id);
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

TEST(FastMath, PixelsAreTheSameBeforeAndAfterLoadingIt) {
  const Subject lens = open_subject(std::filesystem::path(RELIGN_PLUGIN_DIR) / "lens_system");
  const Subject fast = open_subject(std::filesystem::path(RELIGN_SABOTEURS) / "fast_math");
  const auto state = plugin_host::FloatingPointState::current();
  plugin_host::Scene scene(lens.choice(), {});
  const Frame before = frame_of(scene, lens.choice().id);

  const auto changes = plugin_host::floating_point_changes().count;
  FakeConversation conversation(setup_for(fast.choice(), 5));
  run_trial(fast.choice(), conversation);
  EXPECT_EQ(conversation.steps.size(), conversation.setup.budget);
  // The hazard was there: without the guard around loading, the mode would have stayed changed.
  EXPECT_EQ(plugin_host::floating_point_changes().count, changes + 1);
  EXPECT_TRUE(plugin_host::FloatingPointState::current().same_mode(state));
  volatile double smallest = std::numeric_limits<double>::min();
  volatile double subnormal = smallest / 2;
  EXPECT_GT(subnormal, 0.0);

  expect_equal(before, frame_of(scene, lens.choice().id));
  plugin_host::Scene later(lens.choice(), {});
  expect_equal(before, frame_of(later, lens.choice().id));
}

}  // namespace
}  // namespace relign::plugin_check
