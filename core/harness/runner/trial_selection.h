// Which trials of a plan are run.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "suites/plan.h"

namespace relign::runner {

// Places in the plan of the trials that `only` leaves: key=value, with the keys scene, noise_level, algorithm, protocol
// and instance. Values of one key add up, keys narrow down. Throws Error(bad_input) for what the plan does not have.
std::vector<std::size_t> select_trials(const suites::Plan& plan,
                                       const std::vector<std::pair<std::string, std::string>>& only);

// Groups for a TrialQueue, of positions in `places`: by instance, all its algorithms together, so that one lens is
// mounted once, and a run that is stopped early leaves every algorithm the same instances.
std::vector<std::vector<std::size_t>> group_by_instance(const suites::Plan& plan,
                                                        const std::vector<std::size_t>& places);

}  // namespace relign::runner
