// The paper's scene and displaced lenses for tests.
#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <relign/random.hpp>
#include <string>
#include <vector>

#include "imaging/camera.h"
#include "imaging/reference.h"
#include "imaging/scene_file.h"

namespace relign::imaging {

inline std::string scene_folder() { return std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system/"; }

inline std::string relign_od_file() { return scene_folder() + "relign_od/scene.json"; }

inline const SceneFile& relign_od_scene() {
  static const SceneFile scene = read_scene_file(relign_od_file(), {});
  return scene;
}

inline SceneFile relign_od_scene_with(const SceneChoices& choices) {
  return read_scene_file(relign_od_file(), choices);
}

// camera_2mp with half as many pixels a side.
inline SceneFile small_camera() {
  SceneChoices choices;
  choices.pixels = 960;
  return read_scene_file(scene_folder() + "camera_2mp/scene.json", choices);
}

// Every folder with a scene file, sorted.
inline std::vector<std::string> shipped_scenes() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(scene_folder()))
    if (std::filesystem::exists(entry.path() / "scene.json")) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

inline const std::vector<double>& nominal_pose() {
  static const std::vector<double> pose(5, 0.5);
  return pose;
}

// The last two elements displaced, as at level rho0.5 of the paper's text.
inline optics::Assembly random_assembly(Random& random) {
  std::map<std::string, optics::ElementOffset> offsets;
  for (const char* name : {"L3", "L4"}) {
    optics::ElementOffset offset;
    for (double& shift : offset.shift_mm) shift = 2.5e-4 * random.normal();
    for (double& tilt : offset.tilt_deg) tilt = 0.75 * random.normal();
    offsets[name] = offset;
  }
  return optics::Assembly(relign_od_scene().lens, offsets);
}

// All elements of any lens a little displaced and tilted.
inline std::unique_ptr<MountedLens> random_lens(const SceneFile& scene, Random& random) {
  std::map<std::string, optics::ElementOffset> offsets;
  for (const optics::Element& element : scene.lens.elements)
    offsets[element.name] = {{1e-3 * random.normal(), 1e-3 * random.normal(), 1e-3 * random.normal()},
                             {0.3 * random.normal(), 0.3 * random.normal()}};
  return std::make_unique<MountedLens>(scene, optics::Assembly(scene.lens, offsets));
}

inline std::vector<double> random_pose(Random& random, double low = 0, double high = 1) {
  std::vector<double> pose(5);
  for (double& value : pose) value = random.uniform(low, high);
  return pose;
}

}  // namespace relign::imaging
