// Interface for tracing blocks of rays through a lens by other means than the block kernels: a lens of meshes.
#pragma once

#include "optics/assembly.h"
#include "optics/backward_path.h"
#include "optics/ray_block.h"

namespace relign::optics {

class BlockTracer {
 public:
  virtual ~BlockTracer() = default;
  // Sets the lens as built and its pose. Not while rays are traced.
  virtual void place(const Assembly& assembly, const Motion& lens_to_world, const BackwardPath& path) = 0;
  // Does what BlockKernels::trace does with all operations of an image path and last_frame_to_world: rays start in the
  // path's first frame and end in world coordinates, with transmittance and margin. Thread-safe.
  virtual void trace(RayBlock& block, bool fresnel, int count) const = 0;
};

}  // namespace relign::optics
