// Compares the parts of a results folder's manifest with each other and with the suite text that it holds.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "base/json_source.h"

namespace relign::records {

// Throws Error(bad_input) with every contradiction: a commitment that the suite does not have, or that is to another
// secret; another seed, specification, analysis plan, targets, limits, machine times or prices; other numbers of
// instances, scenes, noise levels or methods than the suite states; a number of trials that is not that of the list.
// Without the suite's text (has_suites) almost nothing is compared. `folder` is for the message.
void require_consistent(const Json& manifest, const std::filesystem::path& folder);

// Whether the manifest has the text of every suite of the folder, so that it could be compared with it. A text without
// scenes, noise levels and methods is not a suite.
bool has_suites(const Json& manifest);

// The name of a scene, noise level or method of a manifest: an entry may be its name alone.
std::string entry_name(const Json& entry);

// The ids of the trials in the manifest's list.
std::set<std::string> ordered_ids(const Json& manifest);

// Whether algorithms of the folder, or of one that it was merged from, ran in a sandbox.
bool ran_in_sandbox(const Json& manifest);

// "program" of every build that recorded trials of the folder, or of those that it was merged from, each once.
std::vector<Json> builds_of(const Json& manifest);
// "results from 2 builds of relign-bench"; empty if they are from one.
std::string builds_note(const Json& manifest);

// Throws Error(bad_input) with the contradictions `found`, if any.
void refuse_contradictions(const std::vector<std::string>& found, const std::filesystem::path& folder);

}  // namespace relign::records
