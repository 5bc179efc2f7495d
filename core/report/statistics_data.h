// What the statistics add to a page's data (page_data.h has the shape).
#pragma once

#include "report/loaded_results.h"
#include "stats/study.h"

namespace relign::report {

// Targets, specification and seed as the results' manifest has them.
stats::StudyOptions study_options(const LoadedResults& results);

// `data` as page_data makes it, of the same results.
void add_statistics(Json& data, const LoadedResults& results, const stats::Study& study);

}  // namespace relign::report
