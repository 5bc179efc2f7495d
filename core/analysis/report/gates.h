// Quality gates: checks of the results that are reported before any verdict.
#pragma once

#include <vector>

#include "report/page_model.h"

namespace relign::report {

// Gates that cannot be tested are absent.
//   ran       every planned trial has ended
//   failures  at most 5 % of the trials failed; present only if failed
//   A/A       two names of one algorithm, if the suite has them, do not differ significantly
//   checks    those of the folder (records/folder_checks.h), with those that were not made; failed ones by their names
//   replay    'verify' reproduced the replayed trials of these records
//   sandbox   algorithms ran in one; present only then
// and, present only if failed:
//   optimum   an error is below the instance's own optimum by more than 1e-6 in MSE and 10 %
//   start     step 0 differs between methods on one instance under one protocol; not on a station
//   merit     a merit is negative, or below the measured RMSE
std::vector<QualityGate> quality_gates(const PageModel& page, const LoadedResults& results);

}  // namespace relign::report
