// What one thread of a camera needs. Internal to camera.cpp and camera_mse.cpp.
#pragma once

#include <algorithm>

#include "imaging/camera.h"
#include "imaging/ray_source.h"

namespace relign::imaging {

constexpr int kSlopeGroups = 2;  // of a noise-free MSE: these are differentiated

struct Camera::Workspace {
  RaySource source;
  RayDerivatives derivatives;
  optics::RayBlock words;  // for the read-out
  float sums[kTilePixels * kTilePixels];
  double light[kMseGroups][kTilePixels * kTilePixels];  // of all views
  double slopes[kSlopeGroups][kTilePixels * kTilePixels][6];
  GhostImage::Workspace paths;

  // Starts the rays of a box of a tile's pixels, with their derivatives if wanted.
  void start(const SceneFile& scene, const View& view, const Tile& tile, const PixelBox& box, bool differentiated) {
    source.start_tile(scene, view.path, tile, box, sums);
    if (differentiated) derivatives.start_tile(view.readings, box.columns * box.rows);
    source.differentiate(differentiated ? &derivatives : nullptr);
  }
};

inline void fill_with_black(const PixelBox& box, int width, float* pixels) {
  for (int row = box.row; row < box.row + box.rows; ++row)
    std::fill_n(pixels + row * width + box.column, box.columns, 0.0F);
}

inline void add_to_pixels(const PixelBox& box, const float* sums, double factor, int width, float* pixels) {
  for (int row = box.row; row < box.row + box.rows; ++row)
    for (int column = box.column; column < box.column + box.columns; ++column)
      pixels[row * width + column] += static_cast<float>(factor * static_cast<double>(*sums++));
}

}  // namespace relign::imaging
