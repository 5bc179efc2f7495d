// Reads a results folder for `verify`: chooses trials to replay, and compares their environment with this one.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "records/manifest.h"
#include "records/stored_trials.h"
#include "runner/run.h"
#include "runner/verify.h"

namespace relign::runner {

struct ChosenTrial {
  std::string id;
  records::StoredTrial where;
};

// Chooses trials to replay, and counts those that cannot be replayed. A sample takes the algorithms in turn, and of
// each the trials with the smallest hashes of seed and id. Throws Error(bad_input) for options.trial.
// Hands every complete trial to `checks`.
std::vector<ChosenTrial> choose_trials(const VerifyOptions& options, const records::Manifest& manifest,
                                       VerifySummary& summary, records::FolderChecks& checks);

// Whether some of the records are from a processor that may give different numbers than this one.
bool made_on_another_processor(const records::Manifest& manifest);
// Compares program and processor.
void compare_machines(const records::Manifest& manifest, std::set<Change>& changes);

// Contradictions between the manifest and `plans`, which the folder's suites and their plugins, as they are now, give:
// other methods or trials, other observations, and other scenes, noise levels, methods or an instance set of equal
// trials: plugins, parameters, data, specifications.
std::vector<std::string> plan_contradictions(const records::Manifest& manifest, const std::vector<PreparedPlan>& plans);

// Number of trials in the manifest that no plan has, because data or definitions changed.
std::size_t trials_of_no_plan(const records::Manifest& manifest, const std::vector<PreparedPlan>& plans);

// Compares builds of the plugins, the scenes' data, parameters and stated training, by display names.
void compare_definitions(const records::Manifest& manifest, const PreparedPlan& prepared, std::set<Change>& changes);

}  // namespace relign::runner
