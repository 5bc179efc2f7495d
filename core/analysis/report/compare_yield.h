// Paired comparison of yields for `compare`.
#pragma once

#include "report/loaded_results.h"
#include "statistics/paired_shares.h"
#include "statistics/rules.h"

namespace relign::report {

struct ComparedSeries {
  const LoadedResults& results;
  const statistics::Series& series;
};

// On common instances, at the last recommendation by the rule; failed trials count as missed. `first` is A. n is 0
// without a specification, if the two specifications differ, or if the required values are not recorded.
statistics::PairedShares compare_yield(const ComparedSeries& a, const ComparedSeries& b, statistics::Rule rule);

}  // namespace relign::report
