#include "cli/plan_check.h"

#include "runner/plan_check.h"

namespace relign::cli {

records::PlanCheck plan_check(Context& context) {
  return [&context](const records::Manifest& manifest) { return runner::check_plan(manifest, context.catalog()); };
}

bool warn_of_failed_checks(const report::Report& report) {
  bool failed = false;
  const auto warn = [&failed](const std::string& text) {
    print_warning(text);
    failed = true;
  };
  for (const std::string& finding : report.findings()) warn("failed check: " + finding);
  for (const report::QualityGate& gate : report.model().gates)
    if (!gate.ok && gate.name == "replay") warn(gate.text);
  return failed;
}

}  // namespace relign::cli
