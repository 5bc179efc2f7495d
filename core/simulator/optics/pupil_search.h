// Where to look for the light of a place near the image: which directions pass the aperture stop of the lens as
// designed, found by looking everywhere, once for a scene. Tables of lenses as built (passing_table.h) start from it.
#pragma once

#include <array>
#include <vector>

#include "optics/assembly.h"
#include "optics/backward_path.h"
#include "optics/ray_block.h"

namespace relign::optics {

// The box of places (lens coordinates, mm) that images may need.
struct PlaceRange {
  double half_width = 0;  // |x|, |y|
  double z_low = 0, z_high = 0;
};

// A box of direction cosines, seen from a place: away from the axis, and across. Light comes from -z.
struct DirectionWindow {
  bool empty = true;
  std::array<double, 2> low{}, high{};
};

class PupilSearch {
 public:
  PupilSearch(const Prescription& lens, const PlaceRange& range);

  // Whether one plane tells regions of all places apart: that of the paraxial exit pupil, or of the last vertex where
  // the pupil is far away. Then every ray that passes crosses the plane within `reach` of the axis. A phone lens has
  // no such plane: its pupils move and swell with the field, and regions are told in direction cosines.
  bool on_plane() const { return on_plane_; }
  double plane_z() const { return plane_z_; }
  double reach() const { return reach_; }
  const PlaceRange& range() const { return range_; }
  // Whether anything passes from anywhere: not where the stop is shut, or opens to less than about f/10000.
  bool sees_light() const;
  // What passes from places as far from the axis, and some more; empty where nothing passes near by.
  DirectionWindow window(const Vec3& place) const;

 private:
  static constexpr int kRadii = 33, kHeights = 3;

  void choose_plane(const Prescription& lens);
  // From the place (radius, 0, z); also whether its rays keep to the plane.
  // `fineness`: how many times finer than usual rays lie side by side. `arrived`: how many rays of the fan passed.
  DirectionWindow look(const BackwardPath& path, double radius, double z, int fineness, RayBlock& block, int& arrived);
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

// Whether rays from a place pass everything up to the aperture stop, by direction cosines; `count` a multiple of 16.
void probe_directions(const BackwardPath& path, const Vec3& place, const double* p, const double* q, int count,
                      bool* passed, RayBlock& block);

}  // namespace relign::optics
