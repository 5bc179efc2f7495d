// What `scene new --camera`, `--stage` and `--spec` add to a scene from a lens file.
#pragma once

#include <filesystem>
#include <string>

#include "cli/app.h"
#include "cli/spec_outlook.h"
#include "cli/workbench.h"
#include "lens_files/scene_layout.h"

namespace relign::cli {

// The scene of a folder's scene.json, on all cores.
LoadedScene load_draft(Context& context, const std::filesystem::path& draft);

// The JSON file of a "spec". Throws Error(bad_input).
Json own_specification(const std::string& file);

// The "movement" of a tolerance file: the path of one, or the only preset of a noise level whose id contains `stage`.
// Throws Error(bad_input), also where the noise level refuses the file.
Json movement_of(Context& context, const std::string& stage);

// Electronics by the brightness of the reference image, and without a specification one by what the design itself
// reaches. Returns a warning where that is little. Throws Error(bad_input) for a target without fields.
std::string complete_camera(Context& context, const std::filesystem::path& draft, lens_files::Layout& layout);

// Checks that the specification of the draft can be judged, and adds to the layout how many lenses can meet it. Throws
// Error.
SpecOutlook outlook_of(Context& context, const std::filesystem::path& draft, unsigned lenses,
                       lens_files::Layout& layout);

}  // namespace relign::cli
