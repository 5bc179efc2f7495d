// One number a method over all scenes and noise levels, and which methods are trained: what the statistics add to a
// page's data beside its groups (docs/statistics.md, "One number for a suite").
//
// data.aggregate [{protocol, label (of folders that are joined), resolution, strata [{scene, noise_level, label,
//                instances}], methods, pairs, profile_places []}], one a protocol:
//   methods[i]   {method, oracle, strata, failed, steps, training_tag (where there is one)}, and where the method has
//                results in all strata n, iqm, iqm_lo95, iqm_hi95, the same of median, gap and area, profile {share,
//                lo95, hi95}, by_step [gap after each step]; of a list of trainings besides trainings [{training,
//                failed, n, iqm
//                ... area_hi95}] and spread {lowest, highest, sd} of their iqm. Best first
//   pairs        [{a, b, n, improvement, lo95, hi95}]: share of the instances on which a ends below b
// data.methods[i].training_tag and group.rows[i].training_tag: "one training", or which training of how many it is;
// absent of methods that were not trained.
#pragma once

#include "report/loaded_results.h"
#include "statistics/study.h"

namespace relign::report {

inline constexpr const char* kOneTraining = "one training";

void add_aggregate(Json& data, const LoadedResults& results, const statistics::Study& study);

// "one training" and the like of a method as tables show it, "" without.
std::string training_tag(const Json& data, const std::string& method);

// aggregate.csv: a row for each method, then one for each of its trainings. results/README.md has the columns.
std::string aggregate_csv(const Json& data);

// As Markdown: a table for each protocol; "" without any.
std::string aggregate_markdown(const Json& data);

}  // namespace relign::report
