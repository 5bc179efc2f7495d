// The check "plan" of results folders with the plugins that the program finds (runner/plan_check.h).
#pragma once

#include "cli/app.h"
#include "records/folder_checks.h"

namespace relign::cli {

// `context` must outlive the function.
records::PlanCheck plan_check(Context& context);

}  // namespace relign::cli
