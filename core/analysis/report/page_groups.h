// The groups of a page, from the trial table and the study.
#pragma once

#include <vector>

#include "report/page_group.h"
#include "statistics/study.h"

namespace relign::report {

std::vector<Group> page_groups(const LoadedResults& results, const statistics::Study& study, const Methods& methods,
                               double smallest_relevant_ratio);

}  // namespace relign::report
