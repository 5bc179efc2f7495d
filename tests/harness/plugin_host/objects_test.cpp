// The host's objects for scenes and noise levels.
#include "plugin_host/objects.h"

#include <gmock/gmock.h>

#include "plugin_host/guard.h"
#include "test_folder.h"

namespace relign::plugin_host {
namespace {

using testing::Each;
using testing::HasSubstr;

Choice tiny(const std::string& broken = "nothing") {
  Catalog catalog;
  catalog.add(std::string(RELIGN_TEST_PLUGINS) + "/tiny_scene");
  return catalog.resolve_or_throw(Kind::scene, "tiny-scene", {{"broken", broken}});
}

TEST(SceneObject, PassesArgumentsAndResults) {
  Scene scene(tiny(), {});
  EXPECT_EQ(scene.describe(), R"({"name": "tiny"})");
  const relign_image reference = scene.reference();
  EXPECT_EQ(reference.width, 4u);
  EXPECT_EQ(reference.height, 3u);
  EXPECT_EQ(reference.pixels[11], 1.0f);
  MountedAssembly assembly = scene.mount("{}");
  std::vector<float> pixels(12);
  assembly.capture({0.25, 0.5}, 7, pixels.data());
  EXPECT_THAT(pixels, Each(7.75f));
  const auto truth = assembly.noise_free_mse({0.125, 0}, 1);
  EXPECT_EQ(truth.mse, 0.125);
  EXPECT_EQ(truth.standard_error, 0.5);
  EXPECT_TRUE(assembly.render_noise_free({0, 0}, pixels.data()));
  EXPECT_THAT(pixels, Each(0.5f));
  const auto average = assembly.render_average({0, 0}, 3, 0.25, 7, pixels.data());
  ASSERT_TRUE(average);
  EXPECT_THAT(pixels, Each(10.f));
  EXPECT_EQ(average->standard_error, 0.25);
  EXPECT_EQ(average->samples_used, 7u);
}

TEST(SceneObject, FailuresNameFunctionAndReason) {
  EXPECT_THAT(test::error_text(ErrorKind::plugin_failed, [] { Scene(tiny("reference"), {}).reference(); }),
              HasSubstr("'tiny_scene' failed in reference: the image is not a complete"));
  EXPECT_THAT(test::error_text(ErrorKind::plugin_failed, [] { Scene(tiny("mount"), {}).mount("{}"); }),
              HasSubstr("failed in mount: cannot mount {}"));
  std::vector<float> pixels(12);
  EXPECT_THAT(test::error_text(ErrorKind::plugin_failed,
                               [&] { Scene(tiny("capture"), {}).mount("{}").capture({0}, 1, pixels.data()); }),
              HasSubstr("failed in capture: the shutter is stuck"));
  EXPECT_THAT(
      test::error_text(ErrorKind::plugin_failed, [] { Scene(tiny("truth"), {}).mount("{}").noise_free_mse({0}, 1); }),
      HasSubstr("failed in noise_free_mse: value or standard error"));
  EXPECT_FALSE(Scene(tiny("no picture"), {}).mount("{}").render_noise_free({0}, pixels.data()));
  EXPECT_FALSE(Scene(tiny(), {}).mount("{}").mtf({0}, 20));
  EXPECT_FALSE(Scene(tiny("no picture"), {}).mount("{}").render_average({0}, 1, 0.1, 0, pixels.data()));
  EXPECT_THAT(
      test::error_text(ErrorKind::plugin_failed,
                       [&] { Scene(tiny("average"), {}).mount("{}").render_average({0}, 1, 0.1, 0, pixels.data()); }),
      HasSubstr("failed in render_average: 'standard_error' is -1; expected a finite number of at least 0"));
}

TEST(SceneObject, AssembliesMoveAndOutliveTheirSceneObject) {
  auto scene = std::make_unique<Scene>(tiny(), HostServices{});
  std::vector<MountedAssembly> assemblies;
  for (int i = 0; i < 3; ++i) assemblies.push_back(scene->mount("{}"));
  scene.reset();
  std::vector<float> pixels(12);
  for (MountedAssembly& assembly : assemblies) assembly.capture({0.5}, 1, pixels.data());
  EXPECT_THAT(pixels, Each(1.5f));
}

TEST(SceneObject, RejectsAlgorithmAsScene) {
  Catalog catalog;
  catalog.add(std::string(RELIGN_TEST_PLUGINS) + "/misbehaving");
  const Choice choice = catalog.resolve_or_throw(Kind::optimizer, "misbehaving");
  EXPECT_THAT(test::error_text(ErrorKind::plugin_rejected, [&] { Scene scene(choice, {}); }),
              HasSubstr("offers no relign.scene/1"));
}

TEST(ObjectHost, PassesServicesToThePlugin) {
  std::vector<std::string> logged;
  HostServices services;
  services.threads = 0;  // the plugin gets at least one
  services.cache_folder = "/cache";
  services.log = [&](int level, const std::string& text) { logged.push_back(std::to_string(level) + text); };
  const Choice choice = tiny();
  const ObjectHost object(*choice.plugin, services);
  const relign_host* host = object.host();
  EXPECT_EQ(host->struct_size, sizeof(relign_host));
  EXPECT_EQ(host->threads, 1u);
  EXPECT_EQ(std::string(host->cache_folder.data, host->cache_folder.size), "/cache");
  EXPECT_EQ(std::string(host->plugin_folder.data, host->plugin_folder.size), choice.plugin->folder.string());
  host->log(host->context, RELIGN_LOG_WARNING, {"hot", 3});
  EXPECT_THAT(logged, testing::ElementsAre("2hot"));
  EXPECT_EQ(host->get_extension(host->context, {"x", 1}), nullptr);
}

TEST(ParameterTable, ChecksNamesAndTypes) {
  Choice choice = tiny();
  auto manifest = std::make_shared<Manifest>(*choice.plugin);
  manifest->parameters = {{"n", ParameterType::number, {}, {}, {}, {}, "", ""},
                          {"i", ParameterType::integer, {}, {}, {}, {}, "", ""},
                          {"b", ParameterType::boolean, {}, {}, {}, {}, "", ""},
                          {"f", ParameterType::file, {}, {}, {}, {}, "", ""},
                          {"j", ParameterType::json, {}, {}, {}, {}, "", ""}};
  choice.plugin = manifest;
  choice.parameters = {{"n", 1.5}, {"i", 3}, {"b", true}, {"f", "/a"}, {"j", {1, 2}}};
  const ParameterTable given(choice);
  const relign_parameters* table = given.table();
  EXPECT_EQ(std::string(table->json.data, table->json.size), R"({"b":true,"f":"/a","i":3,"j":[1,2],"n":1.5})");
  double number = 0;
  std::int64_t integer = 0;
  std::int32_t boolean = 0;
  relign_text text{};
  EXPECT_EQ(table->number(table->context, {"n", 1}, &number), RELIGN_OK);
  EXPECT_EQ(number, 1.5);
  EXPECT_EQ(table->integer(table->context, {"i", 1}, &integer), RELIGN_OK);
  EXPECT_EQ(integer, 3);
  EXPECT_EQ(table->boolean(table->context, {"b", 1}, &boolean), RELIGN_OK);
  EXPECT_EQ(boolean, 1);
  EXPECT_EQ(table->text(table->context, {"f", 1}, &text), RELIGN_OK);
  EXPECT_EQ(std::string(text.data, text.size), "/a");
  EXPECT_EQ(table->number(table->context, {"i", 1}, &number), RELIGN_BAD_ARGUMENT);
  EXPECT_EQ(table->text(table->context, {"j", 1}, &text), RELIGN_BAD_ARGUMENT);
  EXPECT_EQ(table->boolean(table->context, {"x", 1}, &boolean), RELIGN_BAD_ARGUMENT);
  EXPECT_EQ(table->integer(table->context, {nullptr, 0}, &integer), RELIGN_BAD_ARGUMENT);
}

}  // namespace
}  // namespace relign::plugin_host
