// Which lens a verb is about.
#pragma once

#include <filesystem>
#include <string>

#include "cli/app.h"
#include "optics/prescription.h"

namespace relign::cli {

// The scene file of a scene that is made of one: the document of its plugin. Throws Error(bad_input) for another scene.
std::filesystem::path scene_file_of(Context& context, const std::string& scene_id);

// The lens file that this scene file names under "lens".
std::filesystem::path lens_file_of_scene(Context& context, const std::string& scene_id);
optics::Prescription lens_of(Context& context, const std::string& scene_id);

}  // namespace relign::cli
