// The bound of one more image (trials/next_image.h) on instances of a study, stored with the results for reports:
// scenes/<hash>/next_image/<noise level>.json.
#pragma once

#include <filesystem>
#include <vector>

#include "runner/pictures.h"

namespace relign::runner {

// Computes it for every scene and noise level of the plan on the first instances, at most two, and one where images are
// large. The bytes do not depend on the shard, but only the shard with the first trial of the first instance among
// `selected` (positions in the plan's trials) writes them. Keeps files of the same instances. Skips scenes without
// ground truth or noise-free images and stations; a scene that fails yields a message and no file. Throws Error(io).
void write_bounds(const PreparedPlan& prepared, const std::vector<std::size_t>& selected,
                  const std::filesystem::path& results, const PictureOptions& options);

}  // namespace relign::runner
