// The lens and the pose that render and scene landscape are asked for, by the same options.
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

// --noise-level, --instance, --suite-seed, --assembly.
void add_lens_options(CLI::App& verb, LensChoice& choice);

struct ChosenLens {
  std::optional<trials::Instance> instance;
  std::string offsets = "{}";  // as mount takes them
};

// Throws Error(bad_input) when both a level and an assembly are given.
ChosenLens choose_lens(Context& context, const LensChoice& choice, const LoadedScene& scene);

// "nominal", "start" (of the instance) or one number per axis, 0 to 1. Errors name `option`.
std::vector<double> chosen_pose(const std::string& text, const std::string& option, const trials::SceneFacts& facts,
                                const std::optional<trials::Instance>& instance);

// A station shows no pose on demand; throws Error(bad_input) that says what to do instead.
void refuse_station(const LoadedScene& scene, const std::string& scene_id);

}  // namespace relign::cli
