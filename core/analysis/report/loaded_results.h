// A results folder as the report sees it: only the trials of the plan in its manifest, each once.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/json_source.h"
#include "statistics/trial_table.h"

namespace relign::report {

struct LoadedResults {
  std::filesystem::path folder;
  Json manifest = Json::object();  // without its list of trials, which is long
  std::size_t planned = 0;         // trials on that list
  statistics::TrialTable trials;
  std::vector<std::string> incomplete;  // trials with steps and no closing line
  std::size_t from_other_plans = 0;     // complete trials that the manifest's plan does not name; left out
};

// Throws Error: io when nothing can be read, bad_input when the folder holds no results or a newer format.
LoadedResults load_results(const std::filesystem::path& folder);

}  // namespace relign::report
