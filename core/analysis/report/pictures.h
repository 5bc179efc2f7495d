// The pictures of a results folder, ready to embed: of each method's best, median and worst trial the film and the
// images at the start and at the recommended pose, and the reference image of each scene.
//
// A results folder is untrusted input: only PNG and WebP files inside pictures/ are read, and their total size is
// limited. Pictures beyond the limit are referred to by file name.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "records/picture_index.h"
#include "report/scene_axes.h"

namespace relign::report {

// Only PNG and WebP files with a valid signature and size are embedded into a page.
struct Picture {
  std::string data_uri;
  unsigned width = 0, height = 0;
};

// nullopt if the bytes are not such a picture, or its size is 0.
std::optional<Picture> png_picture(const std::string& bytes);
std::optional<Picture> webp_picture(const std::string& bytes);  // lossy, lossless or extended

struct Frame {
  std::uint64_t step = 0;
  std::string file;                    // relative to the results folder
  std::optional<std::size_t> picture;  // index into Gallery::pictures; nullopt if not embedded
};

// Captures of a trial side by side in one picture, each a square of `tile` pixels.
struct Film {
  std::string file;
  unsigned tile = 0;
  std::vector<records::FilmFrame> frames;  // empty: no film
  std::optional<std::size_t> picture;      // index into Gallery::pictures
};

struct TrialPictures {
  std::string trial, scene, noise_level, protocol, algorithm;
  std::string why;  // "best", "median", "worst"
  std::uint64_t instance = 0;
  bool last_capture = false;  // `end` is the last capture, not one at the recommended pose
  Frame start, end;
  Film film;
};

struct Gallery {
  std::vector<Picture> pictures;  // each distinct picture once
  std::vector<TrialPictures> trials;
  std::map<std::string, Frame> references;             // by scene
  std::map<std::string, std::vector<SceneAxis>> axes;  // by scene; set by the caller, from the manifest
  std::map<std::string, std::string> drawings;         // of lenses, data URIs by scene; set by the caller
  std::size_t left_out = 0;                            // pictures beyond the limit, including films
  std::vector<std::string> problems;                   // damaged index, unreadable or rejected files
};

// The methods whose pictures are shown beside the curves: the best of each group.
struct ShownFirst {
  std::string scene, noise_level, protocol, algorithm;
};

inline constexpr std::size_t kMaxPictureBytes = 340'000;  // of the page, to keep that of a quick suite under 700 kB

// Pictures of `first` are embedded before all others. Does not throw for errors inside the folder, which are listed in
// Gallery::problems.
Gallery load_gallery(const std::filesystem::path& results, std::size_t most_bytes = kMaxPictureBytes,
                     const std::vector<ShownFirst>& first = {});

}  // namespace relign::report
