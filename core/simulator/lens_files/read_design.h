// Reads a design program's file of any supported format.
#pragma once

#include <filesystem>
#include <string_view>

#include "lens_files/lens_design.h"

namespace relign::lens_files {

// Detects the format by the extension (.zmx, .seq), else by the content. `file`: name for messages. Throws Error.
LensDesign read_design(std::string_view bytes, const std::string& file);
// The same, but mistakes in surfaces become the design's problems, which draft_lens() throws with its own.
// `configuration`: number of a configuration or zoom position, from 1; 0: the file's current one.
LensDesign read_design_with_problems(std::string_view bytes, const std::string& file, int configuration = 0);
// Reads a file of at most kMaxBytes. Throws Error(io) if it is unreadable.
std::string bytes_of(const std::filesystem::path& file);

}  // namespace relign::lens_files
