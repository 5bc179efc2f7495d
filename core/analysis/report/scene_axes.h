// The stage axes of a scene, from its description in the results folder, to show poses in units. Poses are shares of
// the travel from `lower` to `upper`.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "records/manifest.h"

namespace relign::report {

struct SceneAxis {
  std::string name, unit;
  double lower = 0, upper = 0;
  bool observable = true;  // else a misalignment along it does not count
  double speed_per_s = 0;  // in its unit; 0: as the machine time says for mm or degrees
};

// The file `name` of a scene (an entry of the manifest) in the results folder; empty unless it is a file inside
// scenes/.
std::filesystem::path scene_file(const std::filesystem::path& results, const records::ManifestScene& scene,
                                 const std::string& name);

// By scene name. No entry for a scene whose description is absent, damaged or outside scenes/; does not throw.
std::map<std::string, std::vector<SceneAxis>> scene_axes(const std::filesystem::path& results,
                                                         const records::Manifest& manifest);

}  // namespace relign::report
