// The aggregates over all scenes and noise levels (docs/statistics.md): their part of the model, CSV and Markdown.
#pragma once

#include <string>
#include <vector>

#include "report/page_model.h"

namespace relign::report {

// `methods` give the classes.
std::vector<Aggregate> aggregates_of(const LoadedResults& results, const statistics::Study& study,
                                     const std::vector<Method>& methods);

// aggregate.csv: one row per method, followed by one per training. results/README.md describes the columns.
std::string aggregate_csv(const PageModel& page);

// One Markdown table per protocol; "" without aggregates.
std::string aggregate_markdown(const PageModel& page);

}  // namespace relign::report
