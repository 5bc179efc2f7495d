// The statistics in page_data (page_data.h describes the shape).
#pragma once

#include <optional>

#include "report/loaded_results.h"
#include "statistics/study.h"

namespace relign::report {

// Targets, specification, seed and analysis plan from the manifest, with `rule` instead of the plan's if given. Throws
// Error (bad_input) if the records lack the scores of the rule.
statistics::StudyOptions study_options(const LoadedResults& results,
                                       std::optional<statistics::Rule> rule = std::nullopt);

// An entry of group.pairs.
Json pair_json(const statistics::PairStudy& pair, const statistics::Study& study, double smallest_relevant_ratio);

// Adds to `data`, the page data of the same results.
void add_statistics(Json& data, const LoadedResults& results, const statistics::Study& study);

}  // namespace relign::report
