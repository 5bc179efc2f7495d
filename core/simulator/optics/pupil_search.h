// Finds which directions pass the aperture stop of the lens as designed, for points near its image, by an exhaustive
// scan, once per scene. Tables of lenses as built (passing_table.h) start from it.
#pragma once

#include <array>
#include <vector>

#include "optics/assembly.h"
#include "optics/backward_path.h"
#include "optics/direction_windows.h"
#include "optics/passing_steps.h"
#include "optics/ray_block.h"

namespace relign::optics {

// The box of points (lens coordinates, mm) that images may need.
struct PlaceRange {
  double half_width = 0;  // |x|, |y|
  double z_low = 0, z_high = 0;
  // Of a table of regions: 160 MB. A scene divides them among its wavelengths.
  int most_places = 1 << 20;
};

class PupilSearch {
 public:
  PupilSearch(const Prescription& lens, const PlaceRange& range);

  // The places of a table of regions (passing_table.h), at most range.most_places. They are on a plane if the regions
  // of all points can be described on one: that of the paraxial exit pupil, or of the last vertex if the pupil is far
  // away. Every passing ray then crosses the plane within `reach` of the axis. A phone lens has no such plane, since
  // its pupil moves and grows with the field, and neither has a lens that ends in a plate on the sensor, since places
  // must be as close together as the plane is to the image: their regions are in direction cosines.
  const PassingGrid& grid() const { return grid_; }
  const PlaceRange& range() const { return range_; }
  // Work of tracing a ray of an image: that of crossing a spherical face is 1. Counted, so that it is the same on every
  // machine: polynomial faces cost more, and most where their shape is so bent that a search must find the hit.
  struct Work {
    double faces = 0, searches = 0;
    double all() const { return faces + searches; }
  };
  const Work& work() const { return work_; }
  // A scene of 200 x 200 pixels is then created in half a minute on one core; phone lenses have up to 200.
  static constexpr double kMostWork = 250;
  // The directions that pass at points this far from the axis, with a margin; empty if none passes nearby.
  DirectionWindow window(const Vec3& place) const { return windows().at(place); }
  // Valid while the search is.
  DirectionWindows windows() const { return {samples_.data(), radius_step_, range_.z_low, z_step_}; }

 private:
  static constexpr int kRadii = DirectionWindows::kRadii, kHeights = DirectionWindows::kHeights;

  void choose_plane(const Prescription& lens);
  // Sets the counts and steps of the places on the plane; false if there would be too many.
  bool set_places_on_plane(double plane_from_image);
  void set_places(int half, int heights);  // from the axis to the end of the range, and along it
  // Scans the directions at (radius, 0, z) and clears grid_.on_plane if rays exceed the plane's reach. `fineness`: how
  // many times denser than usual. `arrived`: rays of the fan that passed.
  DirectionWindow probe_place(const BackwardPath& path, double radius, double z, int fineness, RayBlock& block,
                              int& arrived);
  void measure_work(const BackwardPath& path, const Prescription& lens, double z, RayBlock& block);
  DirectionWindow& sample(int radius, int height) {
    return samples_[static_cast<std::size_t>(height * kRadii + radius)];
  }

  PlaceRange range_;
  PassingGrid grid_{};
  Work work_;
  double widest_[2] = {0, 0};  // of any sample on the plane, mm
  double radius_step_ = 0, z_step_ = 0;
  std::vector<DirectionWindow> samples_;
};

// Whether rays from a point with these direction cosines pass everything up to the aperture stop; `count` a multiple of
// 16.
void probe_directions(const BackwardPath& path, const Vec3& place, const double* p, const double* q, int count,
                      bool* passed, RayBlock& block);

}  // namespace relign::optics
