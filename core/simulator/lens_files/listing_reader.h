// The listing that CODE V prints (LIS): table of surfaces, specification data, apertures, refractive indices,
// first-order values. docs/lens_files.md lists what is read.
#pragma once

#include <string_view>

#include "lens_files/lens_design.h"

namespace relign::lens_files {

// Throws Error(bad_input) with file and line of every mistake.
LensDesign read_listing(std::string_view bytes, const std::string& file);
// The same with the mistakes as the design's problems, so that those of its glasses can be told with them.
LensDesign read_listing_with_problems(std::string_view bytes, const std::string& file);

}  // namespace relign::lens_files
