// Readers of keys that suites, scene files and scene descriptions share, so that all three are checked alike.
#pragma once

#include <string>
#include <vector>

#include "base/json_source.h"
#include "base/suite_terms.h"

namespace relign {

// What a suite has that does not state these keys.
inline constexpr unsigned kDefaultSeed = 1, kDefaultInstances = 100, kDefaultFirstInstance = 0, kDefaultSteps = 50;
inline constexpr const char* kDefaultLimits = "soft";

// `pointer` names an existing object of `source`. Mistakes are added to `problems`.
MachineTimeKeys read_machine_time(const JsonSource& source, const std::string& pointer, std::vector<Problem>& problems);

// "spec": the limits of a good alignment. Checks only; records/specification.h reads the values.
void check_specification(const JsonSource& source, const std::string& pointer, std::vector<Problem>& problems);

}  // namespace relign
