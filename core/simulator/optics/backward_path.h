// The way of light taken backwards: from a place on the sensor through the lens to the emitter, as a
// list of block operations (ray_block.h).
#pragma once

#include <memory>
#include <vector>

#include "optics/assembly.h"
#include "optics/ray_block.h"
#include "optics/rigid.h"

namespace relign::optics {

// Where the lens is: lens coordinates to world coordinates. World: origin at the pivot of the stage.
struct BackwardPath {
  Motion into_first_frame;           // world -> the frame in which `ops` begin
  std::vector<Op> ops;               // sensor side to object side
  std::size_t through_aperture = 0;  // how many of them lead through the aperture stop
  Motion world_of_last_frame;        // the frame in which `ops` end -> world
  // No ray's Fresnel transmittance is larger: unpolarised reflection is least at normal incidence (for ratios of
  // indices up to 2 + sqrt(3); a steeper face counts as clear). A little above the product, for rounding.
  double highest_transmittance = 1;
  std::vector<std::shared_ptr<const FaceRings>> rings;  // that operations look at
  std::vector<const Stop*> stops_in_place;              // space to work in
};

// `lens_to_world` is the pose. Faces from back to front with the mesh apertures, stops between, the
// mount's rear rim first. Frames are changed only where an element sits off.
BackwardPath backward_path(const Assembly& assembly, const Motion& lens_to_world);
// The same into a path that may be used again and again; allocates nothing from the second time on.
void set_backward_path(BackwardPath& path, const Assembly& assembly, const Motion& lens_to_world);

// The last operation of an image path: from the last frame to the world, where the emitter's plane is.
Op last_frame_to_world(const BackwardPath& path);

// Puts ray i into a block; both in the path's first frame.
void put_ray(RayBlock& block, int i, const Vec3& start, const Vec3& direction);

// World to a tile's first frame, for rays that start at sensor places relative to `tile_centre`.
void set_first_frame(TileStart& tile, const BackwardPath& path, const Vec3& tile_centre_world);

}  // namespace relign::optics
