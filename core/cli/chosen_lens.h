// Options of render and scene landscape that choose the lens and the pose.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/app.h"
#include "cli/workbench.h"

namespace relign::cli {

struct LensChoice {
  std::string level;
  std::uint64_t instance = 0;
  std::uint64_t suite_seed = 1;
  std::string assembly;
};

// Adds --noise-level, --instance, --suite-seed and --assembly.
void add_lens_options(CLI::App& verb, LensChoice& choice);

struct ChosenLens {
  std::optional<trials::Instance> instance;
  std::string offsets = "{}";  // JSON for plugin_host::Scene::mount
};

// Throws Error(bad_input) if both a level and an assembly are given.
ChosenLens choose_lens(Context& context, const LensChoice& choice, const LoadedScene& scene);

// Parses "nominal", "start" (of the instance), "optimum" (of the lens as built) or one number per axis, 0 to 1. Throws
// Error(bad_input) that names `option`.
std::vector<double> chosen_pose(const std::string& text, const std::string& option, const LoadedScene& scene,
                                const ChosenLens& lens);

// Throws Error(bad_input) for a hardware station, which cannot render a given pose.
void refuse_station(const LoadedScene& scene, const std::string& scene_id);

}  // namespace relign::cli
