// Opens a design program's file, whichever of those we know it is.
#pragma once

#include <filesystem>
#include <string_view>

#include "lens_files/lens_design.h"

namespace relign::lens_files {

// By the name's ending (.zmx, .seq), else by what stands in it. `file` is the name for messages. Throws Error.
LensDesign read_design(std::string_view bytes, const std::string& file);
// The same with the mistakes in its surfaces as the design's problems; draft_lens throws them with its own.
// `configuration`: of a file with several configurations or zoom positions, from 1; 0: as the file stands.
LensDesign read_design_with_problems(std::string_view bytes, const std::string& file, int configuration = 0);
// At most kMostBytes are read. Throws Error(io) when it cannot be.
std::string bytes_of(const std::filesystem::path& file);

}  // namespace relign::lens_files
