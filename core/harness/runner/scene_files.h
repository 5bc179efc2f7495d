// What a report shows of a scene besides its reference image, kept in scenes/<hash>/: the lens in section, and the
// noise-free error around the nominal pose. Made once, after the trials; without it a report is still a report.
#pragma once

#include <atomic>
#include <string>

#include "base/json_source.h"
#include "plugin_host/objects.h"
#include "trials/scene_facts.h"

namespace relign::runner {

// A scene that takes longer for one value (the fastest of five, on this machine) is not mapped in passing.
inline constexpr double kSlowestLandscapeValue = 0.06;  // seconds

// The perfect lens's signed noise-free MSE along each axis through the nominal pose, over the whole travel, and in the
// plane of first and last axis close to it: landscape.json (results/README.md). A pure function of the scene. Null
// where the scene tells no truth, is too slow, or `stop` is up. Throws Error(plugin_failed).
Json measure_landscape(plugin_host::Scene& scene, const trials::SceneFacts& facts, const std::atomic<bool>* stop);

}  // namespace relign::runner
