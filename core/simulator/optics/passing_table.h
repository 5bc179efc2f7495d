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
#include "optics/passing_steps.h"
#include "optics/pupil_search.h"
#include "optics/ray_block.h"

namespace relign::optics {

const Azimuths& azimuths();

class PassingTable {
 public:
  // `search` must outlive the table.
  PassingTable(const Assembly& assembly, const PupilSearch& search);

  // Call add_missing() before region_at(place): it appends the surrounding grid points without a region, each once.
  // Then fill() all of them; different ones may be filled by different threads. `block` is workspace.
  void add_missing(const Vec3& place, std::vector<int>& missing);
  void fill(int missing, RayBlock& block);
  const PassingGrid& grid() const { return search_->grid(); }

  const PupilSearch& search() const { return *search_; }
  // From a point to the sensor side of the lens, in its own coordinates.
  const BackwardPath& path() const { return path_; }
  // Of the grid's places, for region_at(); null before the first was asked for.
  const PassingRegion* regions() const { return regions_.data(); }

 private:
  PassingRegion directions_from(const Vec3& place, RayBlock& block) const;

  BackwardPath path_;
  const PupilSearch* search_;
  std::vector<PassingRegion> regions_;  // of the grid's places; allocated when a pose first needs one
  std::vector<char> requested_;         // per place: has a region, or was appended to `missing`
};

}  // namespace relign::optics
