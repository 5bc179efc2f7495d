// Whether a suite's noise levels and scenes go together, known before any trial.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "plugin_host/objects.h"
#include "suites/suite.h"
#include "trials/scene_facts.h"

namespace relign::runner {

// Draws the first instance of every level for every scene. Throws Error(bad_input) that lists every pair which cannot
// be used. One entry of `facts` per scene; `services` is asked before each draw, by the level's name.
void check_levels(const suites::Suite& suite, const std::vector<trials::SceneFacts>& facts,
                  const std::function<plugin_host::HostServices(const std::string& name)>& services);

}  // namespace relign::runner
