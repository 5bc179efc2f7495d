// What one more image could tell on the lenses of a study (task/next_image.h), kept with the results so that a report
// can draw it: scenes/<hash>/next_image/<noise level>.json.
#pragma once

#include <filesystem>
#include <vector>

#include "runner/pictures.h"

namespace relign::runner {

// For every scene and noise level of the plan, on its first lenses, two at most and one where images are large. The
// same bytes whichever part of the plan ran, but only where the first trial of the first lens is among `selected`
// (places in the plan's trials): one part of many does it. Files of the same lenses stay. A scene without truth,
// without noise-free images or with a stage of its own has none; one that fails costs its file and a message. Throws
// Error(io).
void write_bounds(const PreparedPlan& prepared, const std::vector<std::size_t>& selected,
                  const std::filesystem::path& results, const PictureOptions& options);

}  // namespace relign::runner
