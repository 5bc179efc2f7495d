// Every shipped scene with assemblies far beyond any tolerance: images stay valid. RELIGN_ASSEMBLIES: assemblies per
// scene (200 by hand, also under sanitizers).
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "scene_under_test.h"

namespace relign::imaging {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> scene_folders() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system"))
    if (fs::exists(entry.path() / "scene.json")) files.push_back(entry.path() / "scene.json");
  return files;
}

int assemblies() {
  const char* wanted = std::getenv("RELIGN_ASSEMBLIES");
  return wanted ? std::atoi(wanted) : 4;
}

// Noise-free: irradiance of a radiance of at most 1 is at most pi. A capture counts rays, pi / samples each, divided by
// the survival probability of Russian roulette.
TEST(RandomAssemblies, ImagesAreFiniteAndNoBrighterThanTheEmitter) {
  constexpr float kMaxLight = 3.1415927F;
  const std::vector<fs::path> scenes = scene_folders();
  ASSERT_FALSE(scenes.empty());
  Parallel parallel(2);
  for (const fs::path& file : scenes) {
    SCOPED_TRACE(file.parent_path().filename());
    SceneChoices choices;
    choices.pixels = 60;
    const SceneFile scene = read_scene_file(file, choices);
    Random random(11);
    std::size_t lit = 0;
    for (int number = 0; number < assemblies(); ++number) {
      std::map<std::string, optics::ElementOffset> offsets;
      for (const optics::Element& element : scene.lens.elements) {
        optics::ElementOffset& offset = offsets[element.name];
        for (double& shift : offset.shift_mm) shift = 0.1 * random.normal();
        for (double& tilt : offset.tilt_deg) tilt = 1.5 * random.normal();
      }
      MountedLens lens(scene, optics::Assembly(scene.lens, offsets));
      std::vector<double> pose(scene.axes());
      for (double& value : pose) value = random.uniform();
      std::vector<float> image(scene.sensor.pixels());
      for (const Sampler sampler : {Sampler::paper, Sampler::pupil}) {
        Camera camera(scene, {Transport::fresnel, sampler, 64}, parallel);
        camera.capture(lens, pose, static_cast<std::uint64_t>(number), image.data());
        for (const float value : image) ASSERT_TRUE(value >= 0 && value <= kMaxLight / 0.8F) << number << ": " << value;
        camera.render_noise_free(lens, pose, 1, 16, image.data());
        for (const float value : image) ASSERT_TRUE(value >= 0 && value <= kMaxLight) << number << ": " << value;
      }
      for (const float value : image) lit += value > 0 ? 1 : 0;
    }
    EXPECT_GT(lit, 0U);
  }
}

}  // namespace
}  // namespace relign::imaging
