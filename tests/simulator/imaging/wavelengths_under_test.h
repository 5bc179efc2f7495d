// Scenes of several wavelengths around shipped lenses whose glasses have names.
#pragma once

#include <string>

#include "base/files.h"
#include "base/json_source.h"
#include "scene_under_test.h"

namespace relign::imaging {

// A shipped scene with another list of wavelengths (JSON), read from a temporary file.
inline SceneFile scene_with_wavelengths(const std::string& name, const std::string& wavelengths, int pixels = 0,
                                        const std::string& target = "") {
  const std::filesystem::path folder = scene_folder() + name;
  Json scene = Json::parse(read_file(folder / "scene.json"));
  scene["lens"] = (folder / "lens.json").string();
  if (!wavelengths.empty()) scene["wavelengths"] = Json::parse(wavelengths);
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / ("wavelengths_" + std::to_string(::getpid()) + ".json");
  write_file_atomically(file, scene.dump(1));
  SceneFile read = read_scene_file(file, {1, target, false, pixels});
  std::filesystem::remove(file);
  return read;
}

inline const char* const kThreeWavelengths =
    R"([{"nm": 486.13, "weight": 1}, {"nm": 587.56, "weight": 2}, {"nm": 656.27, "weight": 1.5}])";

}  // namespace relign::imaging
