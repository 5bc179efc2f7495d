// Compares the parts of a results folder's manifest with each other and with the suite text that it holds.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "records/manifest.h"

namespace relign::records {

// Throws Error(bad_input) with every contradiction: a commitment that the suite does not have, or that is to another
// secret; another seed, specification, analysis plan, targets, limits, machine times or prices; other numbers of
// instances, scenes, noise levels or methods than the suite states; a number of trials that is not that of the list.
// Without the suite's text (Manifest::has_suites) almost nothing is compared. `folder` is for the message.
void require_consistent(const Manifest& manifest, const std::filesystem::path& folder);

// Throws Error(bad_input) with the contradictions `found`, if any.
void refuse_contradictions(const std::vector<std::string>& found, const std::filesystem::path& folder);

}  // namespace relign::records
