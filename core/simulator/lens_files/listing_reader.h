// Reads the listing that CODE V prints (LIS): surface table, specification data, apertures, refractive indices,
// first-order values. docs/lens_files.md lists what is supported.
#pragma once

#include <string_view>

#include "lens_files/lens_design.h"

namespace relign::lens_files {

// Throws Error(bad_input) with file and line of every mistake.
LensDesign read_listing(std::string_view bytes, const std::string& file);
// The same, but mistakes become the design's problems, to be reported together with those of its glasses.
LensDesign read_listing_with_problems(std::string_view bytes, const std::string& file);

}  // namespace relign::lens_files
