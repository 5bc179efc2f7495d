// Writes captures of a trial as image files.
#pragma once

#include <filesystem>

#include "trials/scene_facts.h"

namespace relign::cli {

// Writes FOLDER/step-NNN.png with the scene's white at full scale; creates the folder. Throws Error(io).
void save_frame(const std::filesystem::path& folder, unsigned step, const trials::SceneFacts& facts,
                const float* pixels);

}  // namespace relign::cli
