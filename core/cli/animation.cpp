#include "cli/animation.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/files.h"
#include "base/json_source.h"
#include "base/text.h"
#include "cli/chosen_lens.h"
#include "cli/interrupt.h"
#include "drawing/gif.h"
#include "drawing/video.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> parts_between_arrows(const std::string& text) {
  std::vector<std::string> parts;
  std::size_t from = 0;
  for (std::size_t at = text.find("->"); at != std::string::npos; at = text.find("->", from)) {
    parts.push_back(text.substr(from, at - from));
    from = at + 2;
  }
  parts.push_back(text.substr(from));
  return parts;
}

std::vector<std::uint8_t> grey_of(const images::Image& image, double white) {
  std::vector<std::uint8_t> grey(image.values.size());
  std::transform(image.values.begin(), image.values.end(), grey.begin(), [&](float value) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(static_cast<double>(value) / white, 0.0, 1.0) * 255));
  });
  return grey;
}

}  // namespace

std::vector<std::vector<double>> read_pose_path(const std::string& path, const LoadedScene& scene,
                                                const ChosenLens& lens) {
  std::vector<std::vector<double>> poses;
  if (path.find("->") != std::string::npos) {
    for (const std::string& pose : parts_between_arrows(path))
      poses.push_back(chosen_pose(pose, "--animate", scene, lens));
    return poses;
  }
  const JsonSource source = JsonSource::from_file(path);
  std::vector<Problem> problems;
  ObjectReader reader(source, "", problems);
  const Json* listed = reader.get("poses");
  reader.reject_unknown();
  if (listed == nullptr || !listed->is_array() || listed->size() < 2) {
    problems.push_back(source.problem(
        listed == nullptr ? "" : "/poses",
        "\"poses\" must be a list of at least two poses: \"nominal\", \"start\", \"optimum\", or one number per "
        "axis, 0 to 1"));
    throw_if_any(problems);
  }
  for (std::size_t i = 0; i < listed->size(); ++i) {
    const Json& pose = listed->at(i);
    // As text, so that poses in files are checked and reported like poses on the command line.
    std::string text = pose.is_string() ? pose.get<std::string>() : pose.dump();
    if (pose.is_array()) text = text.substr(1, text.size() - 2);
    try {
      poses.push_back(chosen_pose(text, "pose", scene, lens));
    } catch (const Error& error) {
      problems.push_back(source.problem("/poses/" + std::to_string(i), error.what()));
    }
  }
  throw_if_any(problems);
  return poses;
}

std::vector<std::vector<double>> frames_along(const std::vector<std::vector<double>>& path, int frames) {
  std::vector<std::vector<double>> poses;
  const std::size_t legs = path.size() - 1;
  for (int frame = 0; frame < frames; ++frame) {
    const double place = static_cast<double>(legs) * frame / (frames - 1);
    const std::size_t leg = std::min(static_cast<std::size_t>(place), legs - 1);
    const double share = place - static_cast<double>(leg);
    std::vector<double> pose = path[leg];
    for (std::size_t axis = 0; axis < pose.size(); ++axis)
      pose[axis] = (1 - share) * path[leg][axis] + share * path[leg + 1][axis];
    poses.push_back(std::move(pose));
  }
  return poses;
}

images::Image take_image(plugin_host::MountedAssembly& assembly, const trials::SceneFacts& facts,
                         const std::vector<double>& pose, std::optional<std::uint64_t> seed,
                         const std::string& scene_id) {
  images::Image image(facts.image_width, facts.image_height);
  if (seed) {
    assembly.capture(pose, *seed, image.values.data());
  } else if (!assembly.render_noise_free(pose, image.values.data())) {
    throw Error(ErrorKind::bad_input, "--noise-free: scene '" + scene_id + "' does not provide noise-free images");
  }
  return trials::picture_of(facts, image.values.data());
}

void animate(plugin_host::MountedAssembly& assembly, const trials::SceneFacts& facts, const AnimationPlan& plan,
             ProgressMode mode) {
  const bool video = plan.out.extension() == ".mp4";
  const int width = static_cast<int>(facts.image_width), height = static_cast<int>(facts.picture_height());
  if (video) drawing::require_ffmpeg("--out");
  drawing::GreyGif gif(width, height, plan.frames_per_second);
  std::string raw;  // for .mp4: all frames, concatenated
  const std::atomic<bool>& stop = watch_for_stop();
  ProgressPrinter printer(mode, "frames");
  runner::Progress progress;
  progress.doing = "animation";
  progress.total = plan.poses.size();
  for (std::size_t frame = 0; frame < plan.poses.size(); ++frame) {
    printer.update(progress);
    if (stop) {
      printer.finish();
      throw Error(ErrorKind::stopped, "stopped after " + std::to_string(frame) + " of " +
                                          counted(plan.poses.size(), "frame") + "; nothing was written");
    }
    const std::optional<std::uint64_t> seed = plan.noise_free ? std::nullopt : std::optional(plan.seed + frame);
    const std::vector<std::uint8_t> grey =
        grey_of(take_image(assembly, facts, plan.poses[frame], seed, plan.scene_id), facts.image_white);
    if (video)
      raw.append(grey.begin(), grey.end());
    else
      gif.add(grey);
    ++progress.done;
  }
  printer.update(progress);
  printer.finish();
  if (video)
    drawing::write_video(plan.out, raw, width, height, plan.frames_per_second);
  else
    write_file_atomically(plan.out, gif.take());
}

}  // namespace relign::cli
