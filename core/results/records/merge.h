// Merges results folders: the shards of one plan, or new results and a published study. All folders must have the same
// instance set. The result is the union by trial id; records of one trial in several folders are compared.
//
// Memory grows with the number of trials (about 150 bytes each), not with their steps: lines are copied from file to
// file.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "records/folder_checks.h"

namespace relign::records {

struct MergeOptions {
  // Results folders. A folder without a manifest is replaced by the folders "shard-..." in it.
  std::vector<std::filesystem::path> sources;
  std::filesystem::path out;  // new, empty, or made by an earlier merge, which is replaced when the new one is whole
  std::string command;        // for manifest.json
  std::function<void(const std::string&)> on_message;  // notes: different processors, builds, plugins
  bool checked = false;  // the caller has made the checks of every source; else a failed one is an error
  PlanCheck plan;        // of these checks
};

// Throws Error(bad_input) for folders that cannot be merged (naming the differences), are newer, or have damaged trials
// that no other folder has, and for an `out` that merge did not make; Error(io). Replaces `out` only when the merged
// folder is complete.
MergeSummary merge(const MergeOptions& options);

// Throws Error(bad_input), as merge() would, if a run that writes this manifest into `folder` could not be merged with
// these results folders.
void require_mergeable(const std::filesystem::path& folder, const Manifest& manifest,
                       const std::vector<std::filesystem::path>& others);

}  // namespace relign::records
