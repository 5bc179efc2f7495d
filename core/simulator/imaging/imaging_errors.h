// Imaging errors: how the images of a station differ from those that its design promises. Errors alter what methods
// observe, never what is scored: reference, noise-free images, ground truth, own optimum and MTF are of the ideal
// station. For training on random imaging (domain randomisation) and for tests of methods on another station.
//
// Format of the file: docs/formats.md. "White" is the level of a lit pixel of the ideal image.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <relign/random.hpp>

#include "base/json_source.h"

namespace relign::imaging {

// A value is drawn uniformly from [low, high].
struct Range {
  double low = 0, high = 0;
  double draw(Random& random) const { return random.uniform(low, high); }
  int draw_integer(Random& random) const {  // both ends included
    return static_cast<int>(low) + static_cast<int>(random.below(static_cast<std::uint64_t>(high - low) + 1));
  }
};

// Added light. Without blobs and gradient it is uniform.
struct StrayLightErrors {
  Range mean;                      // over the image, in units of white
  Range blob_radius = {0.1, 0.5};  // sigma of a Gaussian along its longer axis, share of the image's longer side
  Range blobs;                     // their number
  Range gradient;                  // mean of a linear and quadratic field relative to that of the blobs
  Range rings, arcs;               // their numbers
  Range ring_share;                // share of the stray light in rings and arcs
};

// Errors of the print.
struct TargetErrors {
  Range scale = {1, 1};  // 1.01: 1 % too large
  Range shift;           // along world x and y, share of the target's side
  Range rotation_deg;    // about z
};

struct ImagingErrors {
  bool each_capture = false;  // drawn anew for each capture, from its frame seed; otherwise once, from `seed`
  std::uint64_t seed = 0;
  double share = 1;        // probability that a capture is altered, drawn from its frame seed
  double error_share = 1;  // probability that a drawn station has each of the errors
  std::optional<TargetErrors> target;
  Range vignetting;  // loss at the corner
  std::optional<StrayLightErrors> stray_light;
  Range blur_px;  // sigma of a Gaussian, in pixels of the scene file's sensor
  Range photon;   // quantum q: a value v becomes q Poisson(v / q); 0: no photon noise
  Range pixel_gain;
  Range gain = {1, 1};
  Range gamma = {1, 1};  // v becomes white (v / white)^gamma
  Range pixel_offset, offset, read_noise;
  Range hot_pixels;  // share of all pixels; they show full_scale
  std::optional<Range> full_scale;
  Range bits;  // of the converter, integer; 0: grey values are not rounded

  // Whether values are limited to 0..full_scale.
  bool has_full_scale() const { return bits.high > 0 || hot_pixels.high > 0; }
};

// Throws Error(bad_input or io) that lists every mistake with its position.
ImagingErrors read_imaging_errors(const std::filesystem::path& file);
ImagingErrors read_imaging_errors(const JsonSource& source);

}  // namespace relign::imaging
