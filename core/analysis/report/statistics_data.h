// The statistics of a group, from the study.
#pragma once

#include <optional>
#include <vector>

#include "report/page_group.h"
#include "report/scene_axes.h"
#include "statistics/study.h"

namespace relign::report {

// Targets, specification, seed and analysis plan from the manifest, with `rule` instead of the plan's if given. Throws
// Error (bad_input) if the records lack the scores of the rule.
statistics::StudyOptions study_options(const LoadedResults& results,
                                       std::optional<statistics::Rule> rule = std::nullopt);

Score score_of(const statistics::Quantiles& values);
Share share_of(std::size_t in, const statistics::Band& share);
// The difference is of logarithms.
Difference difference_of(const statistics::PairedComparison& from, double smallest_relevant_ratio);
Pair pair_of(const statistics::PairStudy& pair, const statistics::Study& study, double smallest_relevant_ratio);

// nullptr if the group has no such method.
const statistics::SeriesStudy* find_series(const statistics::Study& study, const statistics::GroupStudy& group,
                                           const std::string& method);

// Adds to a group with rows all but its rules. `axes` of the scene; `next_image`: excess MSE (scene_bounds.h).
void add_statistics(Group& group, const statistics::GroupStudy& found, const statistics::Study& study,
                    const std::vector<SceneAxis>& axes, double next_image, double smallest_relevant_ratio);

}  // namespace relign::report
