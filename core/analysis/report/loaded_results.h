// A results folder, restricted to the trials of the plan in its manifest, each once.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "records/manifest.h"
#include "statistics/trial_table.h"

namespace relign::report {

struct LoadedResults {
  std::filesystem::path folder;
  records::Manifest manifest;  // without its list of planned trials
  std::size_t planned = 0;     // length of that list
  statistics::TrialTable trials;
  std::vector<std::string> incomplete;  // trials with steps but no closing line
  std::size_t from_other_plans = 0;     // complete trials that are not in the plan, excluded
  records::Checks checks;
};

// Throws Error: io if the folder cannot be read, bad_input if it is not a results folder, has a newer format, is
// damaged or has a manifest that contradicts itself or its suite.
LoadedResults load_results(const std::filesystem::path& folder, const records::PlanCheck& plan = {});

}  // namespace relign::report
