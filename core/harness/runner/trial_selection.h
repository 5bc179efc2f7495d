// Selects the trials of a plan to run.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "suites/plan.h"

namespace relign::runner {

// Positions in the plan of the trials that match `only`: key=value, with the keys scene, noise_level, algorithm,
// protocol and instance. Values of one key are alternatives; different keys must all match. Throws Error(bad_input) for
// keys and values that the plan does not have.
std::vector<std::size_t> select_trials(const suites::Plan& plan,
                                       const std::vector<std::pair<std::string, std::string>>& only);

// Groups for a TrialQueue, of indices into `places`: by instance with all its algorithms, so that a lens is
// mounted once, and a run that is stopped early has the same instances for every algorithm.
std::vector<std::vector<std::size_t>> group_by_instance(const suites::Plan& plan,
                                                        const std::vector<std::size_t>& places);

}  // namespace relign::runner
