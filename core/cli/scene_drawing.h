// The drawing of a scene's lens that `run` leaves in the results folder for reports, which know no optics.
#pragma once

#include <string>

#include "plugin_host/catalog.h"

namespace relign::cli {

// As SVG: `lens draw --scene`. Empty for a scene that is not made of a lens file of ours. Never throws Error: a report
// without it is still a report.
std::string scene_lens_svg(const plugin_host::Choice& scene);

}  // namespace relign::cli
