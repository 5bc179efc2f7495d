// Leads blocks of rays through a lens in place of the block kernels and the prescription's spheres: a lens of meshes.
#pragma once

#include "optics/assembly.h"
#include "optics/backward_path.h"
#include "optics/ray_block.h"

namespace relign::optics {

class BlockTracer {
 public:
  virtual ~BlockTracer() = default;
  // The lens as built, at a pose. Not while rays are traced.
  virtual void place(const Assembly& assembly, const Motion& lens_to_world, const BackwardPath& path) = 0;
  // As BlockKernels::trace does with all operations of an image path and with last_frame_to_world: the rays come in
  // the path's first frame and leave in the world, with transmittance and margin. May be called by several threads.
  virtual void trace(RayBlock& block, bool fresnel, int count) const = 0;
};

}  // namespace relign::optics
