// relign/plugin.h as C++17: compiles alone.
#include <gtest/gtest.h>
#include <relign/plugin.h>

#include <type_traits>

namespace {

// What crosses the border must mean the same to every compiler: no constructors, no hidden members.
template <class... Types>
constexpr bool plain() {
  return ((std::is_standard_layout_v<Types> && std::is_trivially_copyable_v<Types>)&&...);
}
static_assert(plain<relign_text, relign_text_sink, relign_image, relign_host, relign_parameters, relign_task,
                    relign_observation, relign_trial, relign_algorithm_interface, relign_noise_level_interface,
                    relign_scene_interface, relign_scene_noise_free, relign_plugin_description>());

TEST(PluginHeader, InterfaceIdsArePartOfTheAbi) {
  EXPECT_STREQ(RELIGN_ALGORITHM_INTERFACE, "relign.algorithm/1");
  EXPECT_STREQ(RELIGN_NOISE_LEVEL_INTERFACE, "relign.noise-level/1");
  EXPECT_STREQ(RELIGN_SCENE_INTERFACE, "relign.scene/1");
  EXPECT_STREQ(RELIGN_SCENE_NOISE_FREE, "relign.scene.noise-free/1");
  EXPECT_STREQ(RELIGN_PLUGIN_ENTRY_SYMBOL, "relign_plugin_entry");
}

}  // namespace
