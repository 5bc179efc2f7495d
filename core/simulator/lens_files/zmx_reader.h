// Reads Zemax / OpticStudio sequential lens files (.zmx): surfaces (zmx_shape.h), system aperture, fields, wavelengths.
// docs/lens_files.md lists what is supported.
#pragma once

#include <string_view>

#include "lens_files/lens_design.h"

namespace relign::lens_files {

// Throws Error(bad_input) with file and line of every mistake.
LensDesign read_zmx(std::string_view bytes, const std::string& file);
// The same, but mistakes become the design's problems, to be reported together with those of its glasses.
// `configuration`: from 1; 0: the file's current one.
LensDesign read_zmx_with_problems(std::string_view bytes, const std::string& file, int configuration = 0);

}  // namespace relign::lens_files
