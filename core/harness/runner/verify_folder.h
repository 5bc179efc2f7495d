// What `verify` reads of a results folder: which trials are to be replayed, and what they were made with.
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

// A suite of the folder: one, or of a merged folder several.
struct StoredSuite {
  std::string text, file, name;
};
std::vector<StoredSuite> suites_of(const Json& manifest);

// Trials to replay, and the counts of those that cannot be; a sample takes the algorithms in turn, and of each those
// whose hash with the seed is smallest. Throws Error(bad_input) for options.trial.
std::vector<ChosenTrial> choose_trials(const VerifyOptions& options, const Json& manifest, VerifySummary& summary);

// Whether some of the records are of a processor that may give other numbers than this one.
bool made_on_another_processor(const Json& manifest);
// What program and processor are not as they were.
void compare_machines(const Json& manifest, std::set<Change>& changes);

// Scenes' data, and parameters of plugins, by the names shown.
void compare_definitions(const Json& manifest, const PreparedPlan& prepared, std::set<Change>& changes);

}  // namespace relign::runner
