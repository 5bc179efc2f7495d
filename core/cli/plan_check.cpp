#include "cli/plan_check.h"

#include "runner/plan_check.h"

namespace relign::cli {

records::PlanCheck plan_check(Context& context) {
  return [&context](const Json& manifest) { return runner::check_plan(manifest, context.catalog()); };
}

}  // namespace relign::cli
