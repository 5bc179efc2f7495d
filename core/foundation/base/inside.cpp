#include "base/inside.h"

#include <algorithm>

namespace relign {

bool is_inside(const std::filesystem::path& path, const std::filesystem::path& folder) {
  std::error_code path_failed, folder_failed;
  const std::filesystem::path inner = std::filesystem::weakly_canonical(path, path_failed);
  const std::filesystem::path outer = std::filesystem::weakly_canonical(folder, folder_failed);
  return !path_failed && !folder_failed && !outer.empty() &&
         std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end();
}

}  // namespace relign
