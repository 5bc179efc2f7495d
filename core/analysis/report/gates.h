// Whether the numbers of a page may be believed: what must be said before anybody ranks.
#pragma once

#include "report/loaded_results.h"

namespace relign::report {

// [{name, ok, text}]: a few words when all is well, a sentence when not. A gate that cannot be tested is not there.
//   ran       every planned trial has ended            failures  at most 5 % of them failed
//   A/A       one algorithm under two names, when the suite has that, came out alike
//   replay    what 'verify' replayed had the same numbers
// and, only where they ring, the alarms:
//   optimum   an error is below the instance's own optimum by more than 0.0002 and 5 %
//   start     step 0 differs between methods on one instance under one protocol; not on a station
//   merit     a merit is negative, or below the measured RMSE
Json gates_json(const Json& data, const LoadedResults& results);

}  // namespace relign::report
