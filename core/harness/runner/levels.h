// Checks before the first trial that a suite's noise levels fit its scenes.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "plugin_host/objects.h"
#include "suites/suite.h"
#include "trials/scene_facts.h"

namespace relign::runner {

// Draws the first instance of every level for every scene. Throws Error(bad_input) that lists every unusable pair. One
// entry of `facts` per scene; `services` is called before each draw with the level's name. Returns warnings: methods
// that use the history of a batch at levels without batches.
std::vector<std::string> check_levels(
    const suites::Suite& suite, const std::vector<trials::SceneFacts>& facts,
    const std::function<plugin_host::HostServices(const std::string& name)>& services);

}  // namespace relign::runner
