// Targets: what the emitter shows. A square bitmap of radiance (white 1, black 0), looked up
// bilinearly, nothing outside.
//
// A target is named by a text: its name alone ("chessboard"), or with parameters behind a colon
// ("slanted_edges:squares=5,angle_deg=3"). Everything else is the path of an image file.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "images/image.h"

namespace relign::imaging {

struct TargetParameter {
  std::string name;
  double preset = 0;
  double lowest = 0, highest = 0;
  bool whole = false;
  std::string meaning;
};

struct TargetKind {
  std::string name;
  std::string meaning;
  std::vector<TargetParameter> parameters;
};

const std::vector<TargetKind>& target_kinds();

// Siemens star of the paper: `sectors` white and as many black sectors of equal angle, white from 0
// upwards (column axis to the right, counter-clockwise as displayed), reaching to the border.
// texels x texels, each black or white by its centre.
images::Image siemens_star(int texels, int sectors = 18);

// A named target, texels x texels. Where an edge crosses a texel, it is as grey as the share of it that is white, in
// steps of 1/255; the star is black or white. Nothing for a text that is to be taken as a path. Throws
// Error(bad_input) for parameters that cannot be, and for a text that looks like a name, is none and is no file.
std::optional<images::Image> draw_target(const std::string& text, int texels);

// An image file as a target; what is not square gets black borders. At most 8192 texels a side.
// Throws Error like images::read_image.
images::Image target_from_file(const std::filesystem::path& file);

}  // namespace relign::imaging
