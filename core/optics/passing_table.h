// Which directions can pass the aperture stop of a lens, as built, from any place near its image: the
// region that pupil samplers draw from. What lies beyond the stop is left out: it only takes light
// away, and its edges would make the region change too fast from place to place.
//
// For places on a grid (lens coordinates) the table holds the passing region on the exit pupil's
// plane as a convex polygon: supports[k] is the largest x cos(phi_k) + y sin(phi_k) over the region,
// phi_k = 2 pi k / kSupports. Found by tracing float blocks backwards from each place: first a coarse
// grid over the pupil, then bisection along 2 kSupports rays from the region's middle. A margin
// covers what lies between grid places and between bisection rays; tests trace hundreds of
// millions of hemisphere rays against it.
#pragma once

#include <array>
#include <vector>

#include "optics/assembly.h"

namespace relign::optics {

constexpr int kSupports = 16;

struct PassingRegion {
  bool empty = true;
  std::array<double, 2> middle{};            // mm, on the pupil plane
  std::array<double, kSupports> supports{};  // mm, from the middle
};

class PassingTable {
 public:
  // The box of places (lens coordinates, mm) that images may need.
  struct Range {
    double half_width = 0;  // |x|, |y|
    double z_low = 0, z_high = 0;
  };
  PassingTable(const Assembly& assembly, const Range& range);

  double pupil_z() const { return pupil_z_; }
  // The region seen from a place: between the grid's places, widened by the margin. Empty outside the
  // range and where nothing passes.
  PassingRegion at(const Vec3& place) const;

 private:
  const PassingRegion& node(int ix, int iy, int iz) const;
  double pupil_z_ = 0;
  double step_ = 0;  // mm, x and y
  double step_z_ = 0;
  int count_ = 0;  // per x and y
  int count_z_ = 0;
  double low_ = 0;  // x and y of node 0
  double low_z_ = 0;
  std::vector<PassingRegion> nodes_;
};

// cos and sin of 2 pi k / n for n = kSupports or 2 kSupports.
std::array<double, 2> support_direction(int k, int n);

}  // namespace relign::optics
