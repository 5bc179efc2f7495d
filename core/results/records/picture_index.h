// pictures/index.json of a results folder: which trials have pictures, and the numbers of the captures in them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/described.h"

namespace relign::records {

struct PictureFrame {
  unsigned step = 0;
  std::string file;  // relative to pictures/

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"step"}, s.step...);
    visit(Member{"file"}, s.file...);
  }
};

// One capture of a film; NaN: unknown. Scores as pages show them.
struct FilmFrame {
  unsigned step = 0;
  std::vector<double> commanded_pose, true_pose;
  double measured = 0, commanded = 0, recommended = 0, machine_seconds = 0;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"step"}, s.step...);
    visit(Member{"commanded_pose", "a share of the travel for each axis"}, s.commanded_pose...);
    visit(Member{"true_pose", "a share of the travel for each axis; null where unknown", kMayBeNull}, s.true_pose...);
    visit(Member{"measured", "", kMayBeNull}, s.measured...);
    visit(Member{"commanded", "", kMayBeNull}, s.commanded...);
    visit(Member{"recommended", "", kMayBeNull}, s.recommended...);
    visit(Member{"machine_seconds", "", kMayBeNull}, s.machine_seconds...);
  }
};

// Captures of a trial side by side in one picture, each a square of `tile` pixels.
struct FilmEntry {
  std::string file;
  unsigned tile = 1;
  std::vector<FilmFrame> frames;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"file"}, s.file...);
    visit(Member{.key = "tile", .meaning = "pixels a side", .least = 1}, s.tile...);
    visit(Member{"frames"}, s.frames...);
  }
};

struct PicturedTrial {
  std::string trial, scene, noise_level, protocol = "paper", algorithm;
  std::uint64_t instance = 0;
  std::string why = "best", shows = "recommended";
  std::vector<PictureFrame> frames;
  std::optional<FilmEntry> film;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{.key = "trial", .pattern = "^[0-9a-f]{16}$"}, s.trial...);
    visit(Member{"scene"}, s.scene...);
    visit(Member{"noise_level"}, s.noise_level...);
    visit(Member{.key = "protocol", .one_of = "paper blind"}, s.protocol...);
    visit(Member{"algorithm"}, s.algorithm...);
    visit(Member{"instance"}, s.instance...);
    visit(Member{.key = "why", .one_of = "best median worst"}, s.why...);
    visit(Member{.key = "shows", .one_of = "recommended last_capture"}, s.shows...);
    visit(Member{"frames"}, s.frames...);
    visit(Member{"film", "", kMayLack | kMayBeNull}, s.film...);
  }
};

// The reference image of a scene.
struct ReferencePicture {
  std::string scene, file;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"scene"}, s.scene...);
    visit(Member{"file"}, s.file...);
  }
  bool operator==(const ReferencePicture&) const = default;
};

struct PictureIndex {
  unsigned format = 1;
  std::vector<PicturedTrial> trials;
  std::vector<ReferencePicture> references;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{.key = "format", .meaning = "of the file; readers refuse newer ones", .least = 1, .most = 1},
          s.format...);
    visit(Member{"trials"}, s.trials...);
    visit(Member{"references"}, s.references...);
  }
};

// That of a results folder; an empty one without a file. Throws Error(bad_input) for a damaged one and NewerFormat.
PictureIndex read_picture_index(const std::filesystem::path& results);
void write_picture_index(const std::filesystem::path& results, const PictureIndex& index);

}  // namespace relign::records
