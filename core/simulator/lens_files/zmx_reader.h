// Zemax / OpticStudio sequential lens files (.zmx): surfaces (zmx_shape.h), system aperture, fields, wavelengths.
// docs/lens_files.md lists what is read.
#pragma once

#include <string_view>

#include "lens_files/lens_design.h"

namespace relign::lens_files {

// Throws Error(bad_input) with file and line of every mistake.
LensDesign read_zmx(std::string_view bytes, const std::string& file);
// The same with the mistakes as the design's problems, so that those of its glasses can be told with them; of
// one of its configurations or zoom positions, from 1 (0: as the file stands).
LensDesign read_zmx_with_problems(std::string_view bytes, const std::string& file, int configuration = 0);

}  // namespace relign::lens_files
