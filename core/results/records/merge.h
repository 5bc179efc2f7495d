// Joins results folders: shards of one plan, or a newcomer's results beside a published study. What belongs together
// has the same instance set; the union is by trial id, and what two folders tell of one trial is compared.
//
// Memory goes with the number of trials (about 150 bytes each), never with their steps: lines are copied from file to
// file.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "records/compare.h"

namespace relign::records {

struct MergeOptions {
  // Results folders. One without a manifest stands for the folders "shard-..." in it.
  std::vector<std::filesystem::path> sources;
  std::filesystem::path out;  // new, empty, or made by an earlier merge, which is replaced when the new one is whole
  std::string command;        // for manifest.json
  std::function<void(const std::string&)> on_message;  // what is worth knowing: other processors, builds, plugins
};

// One trial that two folders tell differently. The one of `kept` is in the merged folder.
struct Disagreement {
  std::string trial, label;  // label: "compass on relign_od rho0.25 #3"
  std::filesystem::path kept, other;
  Difference difference;  // was: kept, is: other
};

struct MergeSummary {
  std::size_t trials = 0;            // complete ones in the merged folder
  std::size_t missing = 0;           // planned by a source, complete in none
  std::size_t duplicates = 0;        // records beyond the first of a trial that agree with it
  std::size_t within_tolerance = 0;  // of these: equal within kOtherCpuTolerance only, made on different processors
  std::size_t superseded = 0;        // records that ended early where another one came to its end
  std::size_t half_written = 0;      // trials with steps but no closing line
  std::size_t left_out = 0;          // of an earlier form of a source's suite
  std::size_t disagreeing = 0;       // trials; `disagreements` has the first kNamedDisagreements of them
  std::vector<Disagreement> disagreements;
  unsigned shards = 0;  // of the one plan that all sources belong to; 0: no plan, or several
  std::vector<unsigned> missing_shards;
};
inline constexpr std::size_t kNamedDisagreements = 1000;

Json to_json(const MergeSummary& summary);

// Throws Error: bad_input for folders that do not belong together (with what differs), are damaged or newer, and for an
// `out` that merge did not make; io. Until the merged folder is whole, what was at `out` stays as it is.
MergeSummary merge(const MergeOptions& options);

}  // namespace relign::records
