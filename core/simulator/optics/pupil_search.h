// Finds which directions pass the aperture stop of the lens as designed, for points near its image, by an exhaustive
// scan, once per scene. Tables of lenses as built (passing_table.h) start from it.
#pragma once

#include <array>
#include <vector>

#include "optics/assembly.h"
#include "optics/backward_path.h"
#include "optics/direction_windows.h"
#include "optics/ray_block.h"

namespace relign::optics {

// The box of points (lens coordinates, mm) that images may need.
struct PlaceRange {
  double half_width = 0;  // |x|, |y|
  double z_low = 0, z_high = 0;
};

class PupilSearch {
 public:
  PupilSearch(const Prescription& lens, const PlaceRange& range);

  // Whether the regions of all points can be described on one plane: that of the paraxial exit pupil, or of the last
  // vertex if the pupil is far away. Every passing ray then crosses the plane within `reach` of the axis. A phone lens
  // has no such plane, since its pupil moves and grows with the field: its regions are in direction cosines.
  bool on_plane() const { return on_plane_; }
  double plane_z() const { return plane_z_; }
  double reach() const { return reach_; }
  const PlaceRange& range() const { return range_; }
  // Whether any ray passes; false if the stop is closed or smaller than about f/10000.
  bool finds_light() const;
  // The directions that pass at points this far from the axis, with a margin; empty if none passes nearby.
  DirectionWindow window(const Vec3& place) const { return windows().at(place); }
  // Valid while the search is.
  DirectionWindows windows() const { return {samples_.data(), radius_step_, range_.z_low, z_step_}; }

 private:
  static constexpr int kRadii = DirectionWindows::kRadii, kHeights = DirectionWindows::kHeights;

  void choose_plane(const Prescription& lens);
  // Scans the directions at (radius, 0, z) and clears on_plane_ if rays exceed the plane's reach. `fineness`: how many
  // times denser than usual. `arrived`: rays of the fan that passed.
  DirectionWindow probe_place(const BackwardPath& path, double radius, double z, int fineness, RayBlock& block,
                              int& arrived);
  DirectionWindow& sample(int radius, int height) {
    return samples_[static_cast<std::size_t>(height * kRadii + radius)];
  }

  PlaceRange range_;
  bool on_plane_ = true;
  double plane_z_ = 0, reach_ = 0;
  double widest_[2] = {0, 0};  // of any sample on the plane, mm
  double radius_step_ = 0, z_step_ = 0;
  std::vector<DirectionWindow> samples_;
};

// Whether rays from a point with these direction cosines pass everything up to the aperture stop; `count` a multiple of
// 16.
void probe_directions(const BackwardPath& path, const Vec3& place, const double* p, const double* q, int count,
                      bool* passed, RayBlock& block);

}  // namespace relign::optics
