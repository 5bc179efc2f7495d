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

// By the scene's name. A scene whose description is absent, damaged or outside scenes/ has none; never throws.
std::map<std::string, std::vector<SceneAxis>> scene_axes(const std::filesystem::path& results, const Json& manifest);

}  // namespace relign::report
