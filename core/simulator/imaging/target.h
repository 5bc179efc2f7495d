// Targets: the bitmap that the emitter shows, a square of radiance (white 1, black 0), sampled bilinearly, 0 outside.
//
// A target is given as a name ("chessboard"), a name with parameters behind a colon
// ("slanted_edges:squares=5,angle_deg=3"), or the path of an image file.
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

// Draws a named target, texels x texels. A texel on an edge has the grey of its white share, in steps of 1/255; the
// star is black or white. Empty if the text is a path (has a slash, or a dot in its name). Throws Error(bad_input) for
// unknown names and invalid parameters.
std::optional<images::Image> draw_target(const std::string& text, int texels);

// The grid of squares of the targets slanted_edges and camera_chart, each half as wide as the spacing.
struct SquareGrid {
  int per_side = 0;
  double angle_deg = 0;  // from columns to rows
};

// Empty for other targets.
std::optional<SquareGrid> square_grid(const std::string& text);

// Reads an image file as a target; images that are not square get black borders. At most 8192 texels a side. Throws
// Error like images::read_image.
images::Image target_from_file(const std::filesystem::path& file);

}  // namespace relign::imaging
