// The scenes of a results folder as its page shows them, from what the run left in scenes/<hash>/: description.json,
// landscape.json, lens.svg. The folder may come from a stranger: only files inside scenes/, of limited size.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "base/json_source.h"

namespace relign::report {

// page_data's "scene_facts": [{scene, id, summary, width, height, axes [{name, unit, lower, upper}], landscape}], one a
// scene of the manifest; what is absent or damaged is left out. landscape {lines [{axis, unit, away [], rmse []}],
// plane {across, up {name, unit, values []}, rmse [row by row, from the lower ends]}}: noise-free RMSE of the perfect
// lens; `away` is the way from the nominal pose in % of the axis's travel.
Json scene_facts(const std::filesystem::path& results, const Json& manifest);

// Drawings of the lenses as data URIs, by the scene's name. An image of a page runs no script and fetches nothing.
std::map<std::string, std::string> scene_drawings(const std::filesystem::path& results, const Json& manifest);

}  // namespace relign::report
