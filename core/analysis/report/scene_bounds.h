// Lower bounds of the error from the results folder (runner/bounds.h).
#pragma once

#include <filesystem>
#include <string>

#include "base/json_source.h"

namespace relign::report {

// Cramer-Rao bound of one more image: excess MSE above the own optimum, averaged over the instances in the file; NaN if
// absent or damaged.
double next_image_excess(const std::filesystem::path& results, const Json& manifest, const std::string& scene,
                         const std::string& noise_level);

}  // namespace relign::report
