// The cycle of a module on a line: load, align, dispense, cure, inspect.
#pragma once

#include <limits>
#include <optional>

#include "base/suite_terms.h"

namespace relign::statistics {

// What is added to the machine time of alignment; a suite's "cycle" (docs/suites.md).
struct Cycle {
  // Load, dispense, cure and inspect together; NaN: the suite states no cycle.
  double seconds = std::numeric_limits<double>::quiet_NaN();
  bool computing = false;  // the method's own computing time counts, too: host time, which differs from run to run
};
// Of a suite that states one.
Cycle cycle_of(const std::optional<CycleTimes>& stated);

// Time until a module has left the line that was aligned in `align_seconds` of machine time and `steps` steps with
// `ms_per_step` of computing (NaN: unknown).
double cycle_seconds(const Cycle& cycle, double align_seconds, double steps, double ms_per_step);

}  // namespace relign::statistics
