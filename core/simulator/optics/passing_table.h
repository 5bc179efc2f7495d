// Which directions can pass the aperture stop of a lens, as built, from any place near its image: the
// region that pupil samplers draw from. What lies beyond the stop is left out: it only takes light
// away, and its edges would make the region change too fast from place to place.
//
// For places on a grid (lens coordinates) the table holds the passing region as a convex polygon: supports[k] is the
// largest x cos(phi_k) + y sin(phi_k) over the region, phi_k = 2 pi k / kSupports. x and y are places on a plane (the
// exit pupil's, or the last vertex's where the pupil is far away) or, where no plane tells regions apart, direction
// cosines (pupil_search.h). Found by tracing float blocks backwards from each place: first a coarse grid, then
// bisection along 2 kSupports rays from the region's middle. A margin covers what lies between grid places and between
// bisection rays; tests trace hundreds of millions of hemisphere rays against it. Regions are found when a pose first
// needs them: most lenses are looked at from few of the places that the travel allows.
#pragma once

#include <array>
#include <vector>

#include "optics/assembly.h"
#include "optics/backward_path.h"
#include "optics/pupil_search.h"
#include "optics/ray_block.h"

namespace relign::optics {

constexpr int kSupports = 16;

struct PassingRegion {
  bool empty = true;
  std::array<double, 2> middle{};            // mm on the plane, or direction cosines in lens coordinates
  std::array<double, kSupports> supports{};  // from the middle
};

class PassingTable {
 public:
  // `search` outlives the table.
  PassingTable(const Assembly& assembly, const PupilSearch& search);

  // Before at(place): appends the grid places around it whose region is not known, each once; then fill them
  // all, different ones by different threads if you like. `block` is space to work in.
  void add_missing(const Vec3& place, std::vector<int>& missing);
  void fill(int missing, RayBlock& block);
  std::size_t grid_places() const { return nodes_.size(); }

  const PupilSearch& search() const { return *search_; }
  // The region seen from a place: between the grid's places, widened by the margin. Empty outside the
  // range and where nothing passes.
  PassingRegion at(const Vec3& place) const;

 private:
  // The cell of the grid that holds a place, and where in it; false outside the range.
  struct Cell {
    int ix = 0, iy = 0, iz = 0;
    double fu = 0, fv = 0, fw = 0;
  };
  bool find_cell(const Vec3& place, Cell& cell) const;
  int node_index(int ix, int iy, int iz) const { return (iz * count_ + iy) * count_ + ix; }

  PassingRegion directions_from(const Vec3& place, RayBlock& block) const;

  BackwardPath path_;
  const PupilSearch* search_;
  double step_ = 0;  // mm, x and y
  double step_z_ = 0;
  int count_ = 0;  // per x and y
  int count_z_ = 0;
  double low_ = 0;  // x and y of node 0
  double low_z_ = 0;
  std::vector<PassingRegion> nodes_;
  std::vector<char> asked_;  // of each node: known, or among the missing
};

// cos and sin of 2 pi k / n for n = kSupports or 2 kSupports.
std::array<double, 2> support_direction(int k, int n);

}  // namespace relign::optics
