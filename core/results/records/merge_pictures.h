// Copies the other files of merged folders: logs, pictures, scenes. Internal to this module.
#pragma once

#include <filesystem>

#include "records/merge_index.h"

namespace relign::records {

// Copies the logs of the trials in `index` (without duplicates), the scenes' files, and the pictures of the best, the
// median and the worst trial among those with pictures. Each shard has pictures of its own three: best and worst are
// those of the whole study, the median is the median of the shards' medians. Throws Error(io).
void copy_files(const MergeIndex& index, const std::filesystem::path& out);

}  // namespace relign::records
