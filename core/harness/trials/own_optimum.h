// The best pose of one instance, whether its scene knows it or the harness searches for it.
#pragma once

#include <cstdint>
#include <optional>

#include "plugin_host/objects.h"
#include "trials/scene_facts.h"

namespace relign::trials {

// Of the scene, or, where its description has "own_optimum": "searched", the lowest score that a search finds: BOBYQA
// (Powell 2009, of NLopt) over the observable axes, Sbplx over a single one, from the nominal pose and three poses that
// the seed draws, each with at most 60 scores an axis, then once more with small strides from the best. Poses have six
// decimals. Nothing where the scene has neither, or no ground truth. Throws as the scene's score does.
std::optional<plugin_host::MountedAssembly::Optimum> own_optimum(plugin_host::MountedAssembly& assembly,
                                                                 const SceneFacts& scene, std::uint64_t seed);

}  // namespace relign::trials
