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

// The JSON file of a "spec", checked. Throws Error(bad_input).
Json own_specification(const std::string& file);

// The "movement" of a tolerance file: the path of one, or the only preset of a noise level whose id contains `stage`.
// Throws Error(bad_input), also where the noise level refuses the file.
Json movement_of(Context& context, const std::string& stage);

// Electronics by the brightness of the reference image, and without a specification one by what the design itself
// reaches. Returns a warning where that is little. Throws Error(bad_input) for a target without fields.
std::string complete_camera(const LoadedScene& scene, lens_files::Layout& layout);

// Checks that the layout's specification can be judged on the scene, and adds to the layout how many lenses of the
// draft's tolerances can meet it. Throws Error.
SpecOutlook outlook_of(Context& context, const LoadedScene& scene, const std::filesystem::path& draft, unsigned lenses,
                       lens_files::Layout& layout);

}  // namespace relign::cli
