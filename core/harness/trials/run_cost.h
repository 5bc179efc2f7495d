// How long the parts of a run take on this machine, timed while as many workers as a run has do the same: cores that
// share a processor's units or its memory are slower together than one alone. For validate.
#pragma once

#include "plugin_host/objects.h"
#include "trials/judge.h"
#include "trials/scene_facts.h"

namespace relign::trials {

// Seconds of one worker.
struct RunCost {
  double capture = 0;
  double noise_free = 0;  // one noise-free RMSE; 0: the scene has no ground truth
  double instance = 0;    // mounting an instance, and the search for its own optima
  double judging = 0;     // the criteria of one step
};

// Times an instance of `level` on every worker, at the nominal pose and at its start, and returns the means. For scenes
// with a simulated stage. `services` are for one thread. Throws Error.
RunCost measure_run_cost(const plugin_host::Choice& scene, const plugin_host::Choice& level, const Criteria& criteria,
                         const plugin_host::HostServices& services, unsigned workers);

}  // namespace relign::trials
