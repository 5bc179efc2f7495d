// Requirements of a station (a scene that owns its stage) on a suite: no noise level, no merit that needs
// ground truth, and no algorithm that requires the start.
#pragma once

#include <string>
#include <vector>

#include "suites/plan.h"
#include "suites/suite.h"
#include "trials/scene_facts.h"

namespace relign::runner {

// Throws Error(bad_input) that lists every mistake. One entry of `facts` per scene of the suite.
void check_stations(const suites::Suite& suite, const std::vector<trials::SceneFacts>& facts);

// False for an algorithm that requires the start pose on a station, where it is unknown.
bool can_run_on(const suites::AlgorithmEntry& algorithm, const trials::SceneFacts& scene);

// Removes algorithms from the suite that can run on none of its scenes. Returns a message per algorithm and scene that
// is skipped. Throws Error(bad_input) when no algorithm remains.
std::vector<std::string> leave_out_told_methods(suites::Suite& suite, const std::vector<trials::SceneFacts>& facts);

// Removes the trials of the algorithms that were skipped on some scenes only.
void leave_out_told_trials(suites::Plan& plan, const std::vector<trials::SceneFacts>& facts);

}  // namespace relign::runner
