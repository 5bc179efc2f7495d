// Draws a scene's lens for the results folder, because reports do not depend on optics.
#pragma once

#include <string>

#include "plugin_host/catalog.h"

namespace relign::cli {

// The SVG of `lens draw --scene`; empty for a scene without a lens file of ours. Does not throw Error: the drawing is
// optional.
std::string scene_lens_svg(const plugin_host::Choice& scene);

}  // namespace relign::cli
