// Animations along a path of poses, for render --animate.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/chosen_lens.h"
#include "cli/progress.h"
#include "images/image.h"
#include "plugin_host/objects.h"
#include "trials/scene_facts.h"

namespace relign::cli {

// Parses "start->nominal", or reads a file {"poses": [[0.5, ...], "nominal", ...]}; at least two poses, each one true
// coordinate per axis from 0 to 1. Throws Error(bad_input).
std::vector<std::vector<double>> read_pose_path(const std::string& path, const LoadedScene& scene,
                                                const ChosenLens& lens);

// `frames` (at least 2) poses, interpolated linearly, both ends included; every leg takes the same time.
std::vector<std::vector<double>> frames_along(const std::vector<std::vector<double>>& path, int frames);

struct AnimationPlan {
  std::vector<std::vector<double>> poses;  // one per frame
  std::uint64_t seed = 0;                  // of the first frame; frame k has seed + k
  bool noise_free = false;
  double frames_per_second = 20;
  std::filesystem::path out;  // .gif or .mp4
  std::string scene_id;       // for errors
};

// Renders and writes the animation. Throws Error: bad_input if .mp4 is wanted without ffmpeg, stopped after Ctrl-C
// (nothing is written then), io.
void animate(plugin_host::MountedAssembly& assembly, const trials::SceneFacts& facts, const AnimationPlan& plan,
             ProgressMode progress);

// A capture with this seed; without a seed the noise-free image. Throws Error(bad_input) if the scene does not provide
// noise-free images.
images::Image take_image(plugin_host::MountedAssembly& assembly, const trials::SceneFacts& facts,
                         const std::vector<double>& pose, std::optional<std::uint64_t> seed,
                         const std::string& scene_id);

}  // namespace relign::cli
