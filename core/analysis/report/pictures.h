// The pictures of a results folder, ready to embed: the films of each method's best, median and worst trial, what the
// sensor saw at the start and at the recommended pose of each, and each scene's reference.
//
// A results folder may come from a stranger: only PNG and WebP files inside pictures/ are read, and their
// sum is limited. What does not fit is named, not embedded.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "report/picture_file.h"
#include "report/scene_axes.h"

namespace relign::report {

struct Frame {
  std::uint64_t step = 0;
  std::string file;                    // relative to the results folder
  std::optional<std::size_t> picture;  // index into Gallery::pictures; none when it could not be embedded
};

// One capture of a film, and what was known of it; NaN and empty where nobody knows.
struct FilmFrame {
  std::uint64_t step = 0;
  std::vector<double> commanded_pose, true_pose;        // shares of the travel
  double measured = 0, commanded = 0, recommended = 0;  // RMSE
  double machine_seconds = 0;
};

// Captures of one trial side by side in one picture, each in a square of `tile` pixels.
struct Film {
  std::string file;
  unsigned tile = 0;
  std::vector<FilmFrame> frames;       // empty: this trial has no film
  std::optional<std::size_t> picture;  // index into Gallery::pictures
};

struct TrialPictures {
  std::string trial, scene, noise_level, protocol, algorithm;
  std::string why;  // "best", "median", "worst"
  std::uint64_t instance = 0;
  bool last_capture = false;  // `end` is the trial's last capture, not one at the recommended pose
  Frame start, end;
  Film film;
};

struct Gallery {
  std::vector<Picture> pictures;  // each distinct picture once
  std::vector<TrialPictures> trials;
  std::map<std::string, Frame> references;             // by scene
  std::map<std::string, std::vector<SceneAxis>> axes;  // by scene; filled by who knows the manifest
  std::map<std::string, std::string> drawings;         // of lenses, data URIs by scene; as axes
  std::size_t left_out = 0;                            // pictures over the limit, films among them
  std::vector<std::string> problems;                   // a damaged index, unreadable or refused files
};

// Whose pictures stand beside the curves, where readers look first: of each group its best method.
struct ShownFirst {
  std::string scene, noise_level, protocol, algorithm;
};

inline constexpr std::size_t kMostPictureBytes = 520'000;  // of the page, so that a quick suite's stays under 1 MB

// Pictures of `first` are embedded before all others, should the limit bite. Never throws for what is wrong inside the
// folder: a report without pictures is still a report.
Gallery load_gallery(const std::filesystem::path& results, std::size_t most_bytes = kMostPictureBytes,
                     const std::vector<ShownFirst>& first = {});

}  // namespace relign::report
