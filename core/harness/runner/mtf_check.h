// Whether the scenes of a suite can tell the MTF that its specification asks for.
#pragma once

#include <optional>
#include <string>

#include "plugin_host/objects.h"
#include "suites/suite.h"
#include "trials/scene_facts.h"

namespace relign::runner {

// What the perfect lens has at the nominal pose; nothing when no MTF is asked for. Throws Error(bad_input) when the
// scene does not tell it, or when the suite's spec asks for diffraction and the scene's MTF has none, or the reverse.
std::optional<plugin_host::MountedAssembly::FieldMtf> check_mtf(const suites::Suite& suite, const std::string& name,
                                                                plugin_host::Scene& scene,
                                                                const trials::SceneFacts& facts);

}  // namespace relign::runner
