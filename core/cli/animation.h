// Animations along a path of poses: what render --animate writes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/progress.h"
#include "images/image.h"
#include "plugin_host/objects.h"
#include "trials/instance.h"
#include "trials/scene_facts.h"

namespace relign::cli {

// "start->nominal", or the name of a file {"poses": [[0.5, ...], "nominal", ...]}; at least two poses.
std::vector<std::vector<double>> read_pose_path(const std::string& path, const trials::SceneFacts& facts,
                                                const std::optional<trials::Instance>& instance);

// `frames` (at least 2) poses: every leg takes the same time, ends included.
std::vector<std::vector<double>> frames_along(const std::vector<std::vector<double>>& path, int frames);

struct AnimationPlan {
  std::vector<std::vector<double>> poses;  // one a frame
  std::uint64_t seed = 0;                  // of the first frame; each has the next one
  bool noise_free = false;
  double frames_per_second = 20;
  std::filesystem::path out;  // .gif or .mp4
  std::string scene_id;       // for errors
};

// Throws Error: bad_input without ffmpeg for .mp4, stopped after Ctrl-C (nothing is written then), io.
void animate(plugin_host::MountedAssembly& assembly, const trials::SceneFacts& facts, const AnimationPlan& plan,
             ProgressMode progress);

// A capture with this seed; without one the expected image. Throws Error(bad_input) when the scene offers none.
images::Image take_image(plugin_host::MountedAssembly& assembly, const trials::SceneFacts& facts,
                         const std::vector<double>& pose, std::optional<std::uint64_t> seed,
                         const std::string& scene_id);

}  // namespace relign::cli
