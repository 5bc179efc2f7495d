// Finds the scene file and the lens of a scene.
#pragma once

#include <filesystem>
#include <string>

#include "cli/app.h"
#include "optics/prescription.h"

namespace relign::cli {

// The scene file from which a scene is made (the document of its plugin). Throws Error(bad_input) if it has none.
std::filesystem::path scene_file_of(Context& context, const std::string& scene_id);

// The lens file that the scene file names under "lens".
std::filesystem::path lens_file_of_scene(Context& context, const std::string& scene_id);
optics::Prescription lens_of(Context& context, const std::string& scene_id);

}  // namespace relign::cli
