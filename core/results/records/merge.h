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

#include "records/difference.h"
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

// A trial whose records differ between two folders. The merged folder has the one of `kept`.
struct Disagreement {
  std::string trial, label;  // label: "compass on relign_od rho0.25 #3"
  std::filesystem::path kept, other;
  Difference difference;  // was: kept, is: other
};

struct MergeSummary {
  std::size_t trials = 0;            // complete ones in the merged folder
  std::size_t missing = 0;           // planned by a source, complete in none
  std::size_t duplicates = 0;        // further records of a trial that agree with the first
  std::size_t within_tolerance = 0;  // of these: from another processor, equal only within kOtherCpuTolerance
  NotCompared not_compared;          // of duplicates: columns that one of the two builds did not have yet
  std::size_t superseded = 0;        // records of failed attempts at a trial that another folder has finished
  std::size_t half_written = 0;      // trials with steps but no closing line
  std::size_t left_out = 0;          // of an earlier version of a source's suite
  std::size_t disagreeing = 0;       // trials; `disagreements` has the first kNamedDisagreements of them
  std::vector<Disagreement> disagreements;
  unsigned shards = 0;  // of the plan that all sources share; 0: none, or several
  std::vector<unsigned> missing_shards;
};
inline constexpr std::size_t kNamedDisagreements = 1000;

// As a manifest keeps it.
MergeFacts facts_of(const MergeSummary& summary);

// Throws Error(bad_input) for folders that cannot be merged (naming the differences), are newer, or have damaged trials
// that no other folder has, and for an `out` that merge did not make; Error(io). Replaces `out` only when the merged
// folder is complete.
MergeSummary merge(const MergeOptions& options);

// Throws Error(bad_input), as merge() would, if a run that writes this manifest into `folder` could not be merged with
// these results folders.
void require_mergeable(const std::filesystem::path& folder, const Manifest& manifest,
                       const std::vector<std::filesystem::path>& others);

}  // namespace relign::records
