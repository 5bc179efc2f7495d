// Reads assembly files, which offset elements of a lens and set uncertain quantities of a scene:
// {"elements": {"L2": {"tilt_deg": [rx, ry], "shift_mm": [x, y, z]}, "waist_um": {"value": 0.2}}}.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace relign::cli {

// The value of "elements" as JSON text, for plugin_host::Scene::mount. `elements` and
// `quantities` are the names that the scene has. Throws Error(bad_input) that lists every mistake.
std::string read_assembly(const std::filesystem::path& file, const std::vector<std::string>& elements,
                          const std::vector<std::string>& quantities = {});

}  // namespace relign::cli
