// What the statistics add to a page's data (page_data.h has the shape).
#pragma once

#include <optional>

#include "report/loaded_results.h"
#include "statistics/study.h"

namespace relign::report {

// Targets, specification, seed and analysis plan as the results' manifest has them; another rule than the plan's where
// one is given. Throws Error (bad_input) where the records lack what the rule needs.
statistics::StudyOptions study_options(const LoadedResults& results,
                                       std::optional<statistics::Rule> rule = std::nullopt);

// A pair of methods by one rule, as page_data.h has it.
Json pair_json(const statistics::PairStudy& pair, const statistics::Study& study, double smallest_relevant_ratio);

// `data` as page_data makes it, of the same results.
void add_statistics(Json& data, const LoadedResults& results, const statistics::Study& study);

}  // namespace relign::report
