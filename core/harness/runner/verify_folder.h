// Reads a results folder for `verify`: chooses trials to replay, and compares their environment with this one.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "base/json_source.h"
#include "records/stored_trials.h"
#include "runner/run.h"
#include "runner/verify.h"

namespace relign::runner {

struct ChosenTrial {
  std::string id;
  records::StoredTrial where;
};

// A suite of the folder; a merged folder may have several.
struct StoredSuite {
  std::string text, file, name;
  std::string secret = {};  // of a sealed suite, once published
};
std::vector<StoredSuite> suites_of(const Json& manifest);

// Chooses trials to replay, and counts those that cannot be replayed. A sample takes the algorithms in turn, and of
// each the trials with the smallest hashes of seed and id. Throws Error(bad_input) for options.trial.
std::vector<ChosenTrial> choose_trials(const VerifyOptions& options, const Json& manifest, VerifySummary& summary);

// Whether some of the records are from a processor that may give different numbers than this one.
bool made_on_another_processor(const Json& manifest);
// Compares program and processor.
void compare_machines(const Json& manifest, std::set<Change>& changes);

// `plans` are those that the folder's suites and their plugins, as they are now, give. Throws Error(bad_input) where
// the manifest has other methods or trials than they do, or states other observations; and where it describes the
// scenes, noise levels, methods or instance set of equal trials otherwise: plugins, parameters, data, specifications.
void require_plans_of_suites(const Json& manifest, const std::vector<PreparedPlan>& plans,
                             const std::filesystem::path& folder);

// Compares builds of the plugins, the scenes' data, parameters and stated training, by display names.
void compare_definitions(const Json& manifest, const PreparedPlan& prepared, std::set<Change>& changes);

}  // namespace relign::runner
