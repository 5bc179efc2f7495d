// The files of a scene for reports, in scenes/<hash>/: the lens in cross-section, and the noise-free error around the
// nominal pose. Made once, after the trials; a report does not require them.
#pragma once

#include <atomic>
#include <string>

#include "base/json_source.h"
#include "plugin_host/objects.h"
#include "trials/scene_facts.h"

namespace relign::runner {

// No landscape of a scene that takes longer for one value (the fastest of five, on this machine).
inline constexpr double kMaxLandscapeValueSeconds = 0.06;  // seconds

// The perfect lens's signed noise-free MSE along each axis through the nominal pose, over the whole travel, and in the
// plane of the first and last axis around it: landscape.json (results/README.md). A pure function of the scene. Null
// for a scene without ground truth or one that is too slow, and once `stop` is true. Throws Error(plugin_failed).
Json measure_landscape(plugin_host::Scene& scene, const trials::SceneFacts& facts, const std::atomic<bool>* stop);

}  // namespace relign::runner
