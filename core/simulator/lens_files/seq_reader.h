// Reads CODE V sequence files (.seq): spheres, conics, aspheres, decentres (also DAR), stop, clear apertures, private
// glasses. docs/lens_files.md lists what is supported.
#pragma once

#include <string_view>

#include "lens_files/lens_design.h"

namespace relign::lens_files {

// Throws Error(bad_input) with file and line of every mistake.
LensDesign read_seq(std::string_view bytes, const std::string& file);
// The same, but mistakes become the design's problems, to be reported together with those of its glasses.
// `configuration`: zoom position, from 1; 0: the first.
LensDesign read_seq_with_problems(std::string_view bytes, const std::string& file, int configuration = 0);

}  // namespace relign::lens_files
