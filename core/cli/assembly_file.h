// Files that say how a lens was put together: {"elements": {"L2": {"tilt_deg": [rx, ry], "shift_mm": [x, y, z]}}}.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace relign::cli {

// The offsets as JSON text, as mount takes them. Throws Error(bad_input) that lists every mistake.
std::string read_assembly(const std::filesystem::path& file, const std::vector<std::string>& elements);

}  // namespace relign::cli
