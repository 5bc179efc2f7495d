// Image quality measures without a reference image, as process engineers use them for alignment.
// For the distance to a reference image see score.h.
//
// Every measure is a pure function of the pixels, NaN where the image does not allow it (no light, no
// edge in the region), and has the same bits on every machine: + - * /, square roots and portable sines in
// a fixed order.
#pragma once

#include <cstddef>
#include <limits>

#include "images/image.h"

namespace relign::images {

inline constexpr double kNotMeasurable = std::numeric_limits<double>::quiet_NaN();

// A non-owning view of an image: row-major, no padding, row 0 at the top.
struct View {
  const float* values = nullptr;
  std::size_t width = 0;
  std::size_t height = 0;

  View(const float* first, std::size_t w, std::size_t h) : values(first), width(w), height(h) {}
  View(const Image& image) : View(image.values.data(), image.width, image.height) {}  // NOLINT: an image is a view
  double at(std::size_t x, std::size_t y) const { return static_cast<double>(values[y * width + x]); }
};

double mean(const View& image);

// RMS contrast: standard deviation / mean. A sinusoidal grating of modulation m has contrast m / sqrt(2).
double contrast(const View& image);

// Normalised gradient energy: mean of gx^2 + gy^2 over the inner pixels (central differences, per pixel) divided by
// mean^2. Unit 1 / px^2, independent of the light level.
double sharpness(const View& image);

// Moments of the light above the background, which is the median of the border pixels. Pixels below it
// count as negative, so that noise averages out and a dark spot on a bright background is found as well.
struct Moments {
  double centroid_x_px = 0;  // 0 = centre of the first column
  double centroid_y_px = 0;  // 0 = centre of the top row
  double width_px = 0;       // sqrt of the mean of the two second central moments: sigma of a Gaussian spot
};
Moments moments(const View& image);

// A circle around the centre of a Siemens star with `cycles` bright spokes.
struct StarCircle {
  double x_px = 0;  // centre of the star
  double y_px = 0;
  double radius_px = 0;
  int cycles = 0;  // bright-dark pairs around the circle
};

// Modulation of the star's fundamental on the circle: amplitude / level, a least-squares fit over the pixels of a
// narrow ring (no interpolation). The spatial frequency is cycles / (2 pi radius_px). A sinusoidal star of modulation m
// gives m; a black and white one gives up to 4 / pi, its fundamental. NaN unless the whole ring is inside the image and
// has at least 4 pixels per cycle.
double star_contrast(const View& image, const StarCircle& circle);

struct Region {
  std::size_t x = 0;  // left column
  std::size_t y = 0;  // top row
  std::size_t width = 0;
  std::size_t height = 0;
};

// Modulation transfer at `cycles_per_pixel` (0 to 1) across the one straight edge in the region, after ISO 12233: the
// edge is located row by row (or column by column), its profile is sampled four times finer than the pixels, and the
// MTF is the Fourier transform of the profile's derivative, corrected for the width of bins and differences. The edge
// must be slanted against the pixel grid (about 2 to 40 degrees) with a margin of about 5 edge widths on both sides.
// NaN where there is no such edge.
double edge_mtf(const View& image, const Region& region, double cycles_per_pixel);

}  // namespace relign::images
