// What a station (a scene that owns its stage) asks of a suite: no noise level, no merit that needs
// truth, and no method that must be told the start.
#pragma once

#include <string>
#include <vector>

#include "suites/suite.h"
#include "trials/scene_facts.h"

namespace relign::runner {

// Throws Error(bad_input) that lists every mistake. One entry of `facts` per scene of the suite.
void check_stations(const suites::Suite& suite, const std::vector<trials::SceneFacts>& facts);

// False for a method that must be told the start pose, on a station, where nobody knows it.
bool can_run_on(const suites::AlgorithmEntry& algorithm, const trials::SceneFacts& scene);

// Takes methods out of the suite that can run on none of its scenes. Returns a sentence per method
// that is left out anywhere. Throws Error(bad_input) when no method is left.
std::vector<std::string> leave_out_told_methods(suites::Suite& suite, const std::vector<trials::SceneFacts>& facts);

}  // namespace relign::runner
