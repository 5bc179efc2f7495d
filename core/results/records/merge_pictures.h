// What lies beside the lines of merged folders: logs, pictures, scenes. Used inside this room.
#pragma once

#include <filesystem>

#include "records/merge_index.h"

namespace relign::records {

// Logs of the trials in `index` (settled), the scenes' own files, and of the pictures those of the best, the median and
// the worst trial among the pictured ones. Shards picture their own three: best and worst are those of the whole, the
// median is the middle of the shards' medians. Throws Error(io).
void copy_files(const MergeIndex& index, const std::filesystem::path& out);

}  // namespace relign::records
