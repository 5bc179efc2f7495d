// What a worker's process is told before its first trial: scenes, levels and algorithms with their manifests and the
// hashes of their libraries. It scans no folder, and what changed on disk since the run began is refused.
#pragma once

#include <set>
#include <string>

#include "runner/provenance.h"
#include "runner/run.h"

namespace relign::runner {

// All but the trials.
Json to_json(const PreparedPlan& prepared, const LibraryHashes& hashes);

struct WorkerPlan {
  PreparedPlan prepared;  // without trials
  LibraryHashes hashes;
  std::set<std::string> looked_at;  // libraries that are what they were

  // Throws Error(plugin_refused) when a library the trial loads is no longer the one that the run began with.
  void check_libraries(const suites::PlannedTrial& trial);
};

// Throws Error.
WorkerPlan worker_plan_from_json(const Json& json);

Json to_json(const suites::PlannedTrial& trial);
suites::PlannedTrial planned_trial_from_json(const Json& json);

}  // namespace relign::runner
