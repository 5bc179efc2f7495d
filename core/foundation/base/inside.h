// Whether a file that a stranger's folder names is in that folder.
#pragma once

#include <filesystem>

namespace relign {

// Links followed, of what exists; false also when that fails. `path` itself need not exist.
bool lies_inside(const std::filesystem::path& path, const std::filesystem::path& folder);

}  // namespace relign
