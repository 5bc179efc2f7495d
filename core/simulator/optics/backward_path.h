// Light paths traced backwards, from a point on the sensor through the lens to the emitter, as a list of block
// operations (ray_block.h).
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "optics/assembly.h"
#include "optics/ray_block.h"
#include "optics/rigid.h"

namespace relign::optics {

// Between two operations of a path.
struct PlaceOnPath {
  std::size_t before = 0;  // this operation
  Motion to_lens;          // from the frame there
};

// World coordinates have their origin at the pivot of the stage.
struct BackwardPath {
  Motion into_first_frame;                                // world -> the frame in which `ops` begin
  std::vector<ExactOp> exact_ops;                         // sensor side to object side
  std::vector<Op> ops;                                    // the same, rounded
  std::vector<PlaceOnPath> into_element, out_of_element;  // by element; out: towards the object
  std::size_t through_aperture = 0;                       // number of operations up to and including the aperture stop
  Motion world_of_last_frame;                             // the frame in which `ops` end -> world
  // Upper bound of every ray's Fresnel transmittance: the product over all faces at normal incidence, where unpolarised
  // reflection is lowest (for index ratios up to 2 + sqrt(3); faces beyond count as 1), plus a margin for rounding.
  double highest_transmittance = 1;
  std::vector<std::shared_ptr<const FaceRings>> rings;  // referenced by `ops`
  std::vector<const Stop*> stops_in_place;              // workspace
};

// `lens_to_world` is the pose. Operations: the barrel's rear rim, then faces from back to front with the mesh apertures
// and the stops between them. Frames change only at elements that are displaced or tilted.
BackwardPath backward_path(const Assembly& assembly, const Motion& lens_to_world);
// The same into a reusable path; does not allocate from the second call on.
void set_backward_path(BackwardPath& path, const Assembly& assembly, const Motion& lens_to_world);

// The last operation of an image path: from the last frame to the world, where the emitter's plane is; `then` on to the
// coordinates of a print that is moved, turned or scaled in this plane.
Op last_frame_to_world(const BackwardPath& path, const std::optional<Motion>& then = std::nullopt);

// Puts ray i into a block; both in the path's first frame.
void put_ray(RayBlock& block, int i, const Vec3& start, const Vec3& direction);

// Puts rays from a place along (x, y, z) - from, all in world coordinates, into a block. count: a multiple of 16.
void aim_rays(RayBlock& block, const BackwardPath& path, const Vec3& place, const Vec3& from, const double* x,
              const double* y, const double* z, int count);

}  // namespace relign::optics
