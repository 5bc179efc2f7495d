// Page data of the aggregates over all scenes and noise levels, and the tags of trained methods (docs/statistics.md).
//
// data.aggregate [{protocol, label (of joined folders), resolution, strata [{scene, noise_level, label, instances}],
//                methods, pairs, profile_places []}], one per protocol:
//   methods[i]   {method, class, oracle, strata, failed, steps, training_tag (if trained)}, best first; with results in
//                all strata also n, iqm, iqm_lo95, iqm_hi95, the same for median, gap and area, profile {share, lo95,
//                hi95} and by_step [gap after each step]; with several trainings also trainings [{training, failed, n,
//                iqm ... area_hi95}] and spread {lowest, highest, sd} of their iqm
//   pairs        [{a, b, n, improvement, lo95, hi95}]: probability of improvement of a over b
// data.methods[i].training_tag and group.rows[i].training_tag: "one training", "3 trainings" or "1 of 3 trainings";
// absent for methods that are not trained.
#pragma once

#include "report/loaded_results.h"
#include "statistics/study.h"

namespace relign::report {

inline constexpr const char* kOneTraining = "one training";

void add_aggregate(Json& data, const LoadedResults& results, const statistics::Study& study);

// The training tag of a method, "" if it is not trained.
std::string training_tag(const Json& data, const std::string& method);

// aggregate.csv: one row per method, followed by one per training. results/README.md describes the columns.
std::string aggregate_csv(const Json& data);

// One Markdown table per protocol; "" without aggregates.
std::string aggregate_markdown(const Json& data);

}  // namespace relign::report
