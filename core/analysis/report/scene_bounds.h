// What the results folder says of the least error that any method could reach (runner/bounds.h).
#pragma once

#include <filesystem>
#include <string>

#include "base/json_source.h"

namespace relign::report {

// How much more squared RMSE than at a lens's own best pose one more image leaves, the mean of the lenses that were
// looked at; NaN where nothing, or nothing sound, is there.
double next_image_excess(const std::filesystem::path& results, const Json& manifest, const std::string& scene,
                         const std::string& noise_level);

}  // namespace relign::report
