// The set-up of a worker's process: scenes, levels and algorithms with their manifests and the hashes of their
// libraries. A worker scans no folders, and refuses files that have changed since the run began.
#pragma once

#include <set>
#include <string>

#include "runner/provenance.h"
#include "runner/run.h"

namespace relign::runner {

// Everything except the trials.
Json to_json(const PreparedPlan& prepared, const LibraryHashes& hashes);

struct WorkerPlan {
  PreparedPlan prepared;  // without trials
  LibraryHashes hashes;
  std::set<std::string> checked;  // unchanged libraries

  // Throws Error(plugin_rejected) when a library that the trial loads has changed since the run began.
  void check_libraries(const suites::PlannedTrial& trial);
};

// Throws Error.
WorkerPlan worker_plan_from_json(const Json& json);

Json to_json(const suites::PlannedTrial& trial);
suites::PlannedTrial planned_trial_from_json(const Json& json);

}  // namespace relign::runner
