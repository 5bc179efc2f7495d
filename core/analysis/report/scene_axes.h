// The axes of a scene's stage, from the scene's own description in the results folder, so that poses can be shown in
// units. Poses are shares of the travel from `lower` to `upper`.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "base/json_source.h"

namespace relign::report {

struct SceneAxis {
  std::string name, unit;
  double lower = 0, upper = 0;
};

// The file `name` of a scene (an entry of the manifest) in the results folder; empty where it is no file inside
// scenes/.
std::filesystem::path scene_file(const std::filesystem::path& results, const Json& scene, const std::string& name);

// By the scene's name. A scene whose description is absent, damaged or outside scenes/ has none; never throws.
std::map<std::string, std::vector<SceneAxis>> scene_axes(const std::filesystem::path& results, const Json& manifest);

}  // namespace relign::report
