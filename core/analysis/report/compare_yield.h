// What `compare` says of yields: lenses in specification with the one and with the other.
#pragma once

#include <string>

#include "report/loaded_results.h"
#include "statistics/paired_shares.h"
#include "statistics/rules.h"

namespace relign::report {

struct ComparedSeries {
  const LoadedResults& results;
  const statistics::Series& series;
};

// On the lenses that both have, at the last recommendation by the rule; a failed trial is a lens missed. first is A. n
// is 0 where there is no specification, the two have not the same, or what it asks for is not known.
statistics::PairedShares compare_yield(const ComparedSeries& a, const ComparedSeries& b, statistics::Rule rule);

// null where n is 0.
Json yield_json(const statistics::PairedShares& yield);
std::string yield_text(const Json& yield);

}  // namespace relign::report
