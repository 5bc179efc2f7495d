// Keys that mean the same in a suite, in a scene file and in what a scene says of itself: one reader of them, so that a
// mistake is a mistake wherever it stands.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/json_source.h"

namespace relign {

// "machine_time": the simulated clock. What is absent is the default of whoever reads it.
struct MachineTimeKeys {
  std::optional<double> speed_mm_per_s, speed_deg_per_s, settle_ms, exposure_ms, readout_ms;
};

// `pointer` names an object of `source` that is there. Mistakes become problems.
MachineTimeKeys read_machine_time(const JsonSource& source, const std::string& pointer, std::vector<Problem>& problems);

// "spec": what counts as good enough. It is kept as it stands (records/specification.h reads what was checked here).
void check_specification(const JsonSource& source, const std::string& pointer, std::vector<Problem>& problems);

}  // namespace relign
