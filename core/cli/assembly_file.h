// Reads assembly files, which offset elements of a lens:
// {"elements": {"L2": {"tilt_deg": [rx, ry], "shift_mm": [x, y, z]}}}.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace relign::cli {

// The value of "elements" as JSON text, for plugin_host::Scene::mount. `elements` are the scene's element names. Throws
// Error(bad_input) that lists every mistake.
std::string read_assembly(const std::filesystem::path& file, const std::vector<std::string>& elements);

}  // namespace relign::cli
