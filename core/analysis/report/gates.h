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
std::vector<QualityGate> quality_gates(const PageModel& page, const LoadedResults& results);

}  // namespace relign::report
