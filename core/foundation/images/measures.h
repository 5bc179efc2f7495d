// What an image says of its own sharpness: the measures that process engineers align by.
//
// When to use something else: distances to a reference image are in score.h.
//
// Every measure is a pure function of the pixels. One that an image does not allow (no light, no
// edge in the region) is NaN. All but edge_mtf use only + - * / and square roots in a fixed order,
// so that they are the same bits on every machine; edge_mtf needs the C library's sine.
#pragma once

#include <cstddef>

#include "images/image.h"

namespace relign::images {

// Pixels that somebody else owns: row-major, tightly packed, row 0 on top.
struct View {
  const float* values = nullptr;
  std::size_t width = 0;
  std::size_t height = 0;

  View(const float* first, std::size_t w, std::size_t h) : values(first), width(w), height(h) {}
  View(const Image& image) : View(image.values.data(), image.width, image.height) {}  // NOLINT: an image is a view
  double at(std::size_t x, std::size_t y) const { return static_cast<double>(values[y * width + x]); }
};

double mean(const View& image);

// Root mean square contrast: standard deviation / mean. A sinusoidal grating of modulation m has m / sqrt(2).
double contrast(const View& image);

// Gradient energy by level: mean of gx^2 + gy^2 over the inner pixels (central differences, per pixel)
// / mean^2. No unit in the light's level, 1 / px^2 in space.
double sharpness(const View& image);

// Moments of the light above the background, the median of the border's pixels; pixels below it count
// negative, so that noise averages out and a dark spot on a bright ground is found as well.
struct Moments {
  double centroid_x_px = 0;  // 0 = middle of the first column
  double centroid_y_px = 0;  // 0 = middle of the top row
  double width_px = 0;       // sqrt of the mean of both second central moments: a Gaussian spot's sigma
};
Moments moments(const View& image);

// A Siemens star of `cycles` bright spokes, seen on a circle.
struct StarCircle {
  double x_px = 0;  // centre of the star
  double y_px = 0;
  double radius_px = 0;
  int cycles = 0;  // bright-dark pairs around the circle
};

// Modulation of the star's fundamental wave on the circle: amplitude / level, by least squares over the pixels of a
// narrow ring (nothing is interpolated). Its spatial frequency is cycles / (2 pi radius_px). A sinusoidal star of
// modulation m gives m; a black and white one gives up to 4 / pi, its fundamental.
// NaN unless the whole ring lies in the image and holds at least 4 pixels a cycle.
double star_contrast(const View& image, const StarCircle& circle);

struct Region {
  std::size_t x = 0;  // left column
  std::size_t y = 0;  // top row
  std::size_t width = 0;
  std::size_t height = 0;
};

// Modulation transfer at `cycles_per_pixel` (0 to 1) across the one straight edge in the region, after ISO 12233: the
// edge is found row by row (or column by column), its profile is sampled four times finer than the pixels, and
// the transform of its derivative is the MTF, corrected for the width of bins and differences.
// The edge must lean against the pixel grid (about 2 to 40 degrees) and have some 5 edge widths of room on both
// sides. NaN where there is no such edge.
double edge_mtf(const View& image, const Region& region, double cycles_per_pixel);

}  // namespace relign::images
