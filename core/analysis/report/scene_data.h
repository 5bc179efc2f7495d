// The scenes of a results folder, from scenes/<hash>/: description.json, landscape.json, lens.svg. The folder is
// untrusted input: only files inside scenes/ and of limited size are read.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "base/json_source.h"

namespace relign::report {

// page_data's "scene_facts": [{scene, id, summary, width, height, axes [{name, unit, lower, upper}], landscape}], one
// per scene of the manifest; absent or damaged parts are left out. landscape {lines [{axis, unit, away [], rmse []}],
// plane {across, up {name, unit, values []}, rmse [row by row, from the lower ends]}}: noise-free RMSE of the nominal
// lens; `away` is the distance from the nominal pose in % of the axis's travel.
Json scene_facts(const std::filesystem::path& results, const Json& manifest);

// Drawings of the lenses as data URIs, by scene name. As images in a page they cannot run scripts or load files.
std::map<std::string, std::string> scene_drawings(const std::filesystem::path& results, const Json& manifest);

}  // namespace relign::report
