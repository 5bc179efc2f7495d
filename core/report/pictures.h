// The pictures of a results folder, ready to embed: what the sensor saw at the start and at the
// recommended pose of each method's best, median and worst trial, and each scene's reference.
//
// A results folder may come from a stranger: only PNG files inside pictures/ are read, and their
// sum is limited. What does not fit is named, not embedded.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace relign::report {

struct Picture {
  std::string data_uri;
  unsigned width = 0, height = 0;
};

struct Frame {
  std::uint64_t step = 0;
  std::string file;                    // relative to the results folder
  std::optional<std::size_t> picture;  // index into Gallery::pictures; none when it could not be embedded
};

struct TrialPictures {
  std::string trial, scene, noise_level, protocol, algorithm;
  std::string why;  // "best", "median", "worst"
  std::uint64_t instance = 0;
  bool last_capture = false;  // `end` is the trial's last capture, not one at the recommended pose
  Frame start, end;
};

struct Gallery {
  std::vector<Picture> pictures;  // each distinct picture once
  std::vector<TrialPictures> trials;
  std::map<std::string, Frame> references;  // by scene
  std::size_t left_out = 0;                 // pictures over the limit
  std::vector<std::string> problems;        // a damaged index, unreadable or refused files
};

inline constexpr std::size_t kMostPictureBytes = 600'000;  // of the page, so that a quick suite's stays under 1 MB

// Never throws for what is wrong inside the folder: a report without pictures is still a report.
Gallery load_gallery(const std::filesystem::path& results, std::size_t most_bytes = kMostPictureBytes);

}  // namespace relign::report
