// Which directions pass the lens as designed, from points near its image (pupil_search.h), for CPU and GPU. NVRTC
// compiles this header.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "optics/motion.h"

namespace relign::optics {

// A box of direction cosines at a point: radial (away from the axis) and tangential. Light comes from -z.
struct DirectionWindow {
  bool empty = true;
  std::array<double, 2> low{}, high{};
};

// Windows at distances from the axis and heights, in lens coordinates.
struct DirectionWindows {
  static constexpr int kRadii = 33, kHeights = 3;
  const DirectionWindow* samples = nullptr;  // kHeights x kRadii
  double radius_step = 0;                    // mm, from the axis
  double low_z = 0, z_step = 0;              // mm

  // The directions that pass at points this far from the axis, with a margin; empty if none passes nearby.
  DirectionWindow at(const Vec3& place) const {
    const double u = std::sqrt(place.x * place.x + place.y * place.y) / radius_step;
    const double w = z_step > 0 ? std::clamp((place.z - low_z) / z_step, 0.0, kHeights - 1.0) : 0;
    // The hull of the surrounding samples and of the next ones inwards, since light ends between two samples.
    DirectionWindow hull;
    const int from = std::max(0, static_cast<int>(u) - 1), to = std::min(kRadii - 1, static_cast<int>(u) + 1);
    for (int radius = from; radius <= to; ++radius)
      for (int height = static_cast<int>(w); height <= std::min(kHeights - 1, static_cast<int>(w) + 1); ++height) {
        const DirectionWindow& one = samples[height * kRadii + radius];
        if (one.empty) continue;
        for (int axis = 0; axis < 2; ++axis) {
          hull.low[axis] = hull.empty ? one.low[axis] : std::min(hull.low[axis], one.low[axis]);
          hull.high[axis] = hull.empty ? one.high[axis] : std::max(hull.high[axis], one.high[axis]);
        }
        hull.empty = false;
      }
    return hull;
  }
};

}  // namespace relign::optics
