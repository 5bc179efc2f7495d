// The importance regions of a lens as built: for any point near its image, the directions that can pass the aperture
// stop. Samplers draw from them. Apertures beyond the stop are ignored: they only block light, and their edges would
// make the region vary too fast from point to point.
//
// For points on a grid (lens coordinates) the table holds the region as a convex polygon: supports[k] is the largest x
// cos(phi_k) + y sin(phi_k) over the region, phi_k = 2 pi k / kSupports. x and y are positions on a plane (that of the
// exit pupil, or of the last vertex if the pupil is far away) or, where no plane describes all regions, direction
// cosines (pupil_search.h). Regions are found by tracing float blocks backwards from each point: first a coarse grid,
// then bisection along 2 kSupports rays from the region's middle. A margin covers deviations between grid points and
// between bisection rays; tests check it with hundreds of millions of hemisphere rays. Regions are computed when a pose
// first needs them, since most lenses need few of the points within the travel.
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
  // `search` must outlive the table.
  PassingTable(const Assembly& assembly, const PupilSearch& search);

  // Call add_missing() before at(place): it appends the surrounding grid points without a region, each once. Then
  // fill() all of them; different ones may be filled by different threads. `block` is workspace.
  void add_missing(const Vec3& place, std::vector<int>& missing);
  void fill(int missing, RayBlock& block);
  std::size_t grid_places() const { return nodes_.size(); }

  const PupilSearch& search() const { return *search_; }
  // The region at a point, interpolated between grid points and widened by the margin. Empty outside the range and
  // where no light passes.
  PassingRegion at(const Vec3& place) const;

 private:
  // The grid cell that contains a point, and the position in it; false outside the range.
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
  std::vector<char> requested_;  // per node: has a region, or was appended to `missing`
};

// cos and sin of 2 pi k / n for n = kSupports or 2 kSupports.
std::array<double, 2> support_direction(int k, int n);

}  // namespace relign::optics
