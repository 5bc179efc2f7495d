// The scenes of a results folder, from scenes/<hash>/: description.json, landscape.json, lens.svg. The folder is
// untrusted input: only files inside scenes/ and of limited size are read.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "records/manifest.h"
#include "report/page_model.h"

namespace relign::report {

// One per scene of the manifest; absent or damaged parts are left out.
std::vector<SceneFacts> scene_facts(const std::filesystem::path& results, const records::Manifest& manifest);

// Drawings of the lenses as data URIs, by scene name. As images in a page they cannot run scripts or load files.
std::map<std::string, std::string> scene_drawings(const std::filesystem::path& results,
                                                  const records::Manifest& manifest);

// Cramer-Rao bound of one more image: excess MSE above the own optimum, averaged over the instances in the file; NaN if
// absent or damaged.
double next_image_excess(const std::filesystem::path& results, const records::Manifest& manifest,
                         const std::string& scene, const std::string& noise_level);

}  // namespace relign::report
