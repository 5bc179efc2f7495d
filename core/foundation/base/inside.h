// Keeps file names from untrusted manifests inside the folder of the manifest.
#pragma once

#include <filesystem>

namespace relign {

// True if `path` is inside `folder` after symbolic links are resolved. `path` need not exist. False if links cannot be
// resolved.
bool is_inside(const std::filesystem::path& path, const std::filesystem::path& folder);

}  // namespace relign
