// Zemax / OpticStudio sequential lens files (.zmx): surfaces (zmx_shape.h), system aperture, fields, wavelengths.
// docs/lens_files.md lists what is read.
#pragma once

#include <string_view>

#include "lens_files/lens_design.h"

namespace relign::lens_files {

// Throws Error(bad_input) with file and line of every mistake.
LensDesign read_zmx(std::string_view bytes, const std::string& file);

}  // namespace relign::lens_files
