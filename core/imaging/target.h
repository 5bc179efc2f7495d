// Targets: what the emitter shows. A square bitmap of radiance (white 1, black 0), looked up
// bilinearly, nothing outside.
#pragma once

#include <filesystem>
#include <string>

#include "pixels/image.h"

namespace relign::imaging {

// Siemens star of the paper: `sectors` white and as many black sectors of equal angle, white from 0
// upwards (column axis to the right, counter-clockwise as displayed), reaching to the border.
// texels x texels, each black or white by its centre.
pixels::Image siemens_star(int texels, int sectors = 18);

// An image file as a target; what is not square gets black borders. At most 8192 texels a side.
// Throws Error like pixels::read_image.
pixels::Image target_from_file(const std::filesystem::path& file);

}  // namespace relign::imaging
