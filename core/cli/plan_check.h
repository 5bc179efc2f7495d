// The checks of results folders: "plan", with the plugins that the program finds (runner/plan_check.h), and what all of
// them found.
#pragma once

#include "cli/app.h"
#include "records/folder_checks.h"
#include "report/report.h"

namespace relign::cli {

// `context` must outlive the function.
records::PlanCheck plan_check(Context& context);

// Prints a warning for each finding of the checks, and for replays that differ; true if there is one.
bool warn_of_failed_checks(const report::Report& report);

}  // namespace relign::cli
