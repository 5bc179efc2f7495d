// The surfaces of a GhostWalk as the block kernels of ghost_block.h take them, and the queues between them.
#pragma once

#include <vector>

#include "optics/ghost_steps.h"
#include "optics/ghost_walk.h"

namespace relign::optics {

class GhostTables {
 public:
  // Does not allocate from the second call on.
  void set(const GhostWalk& walk);

  // Queues: one for each gap and direction, then air, glass by glass, and the two ends.
  int queues() const { return lens_.image_side + 1; }
  int object_side() const { return lens_.object_side; }
  int image_side() const { return lens_.image_side; }
  int entrance() const { return queue_of(surfaces_, false); }  // of rays that come from the sensor
  static int queue_of(int gap, bool to_image) { return ghost_queue(gap, to_image); }
  int search_queue(int glass) const;  // 0: air

  // Of the queues before air's. The lens has the addresses of bodies and stops.
  const std::vector<GhostStep>& steps() const { return steps_; }
  const std::vector<GhostBody>& bodies() const { return bodies_; }
  const std::vector<GhostStop>& stops() const { return stops_; }
  const GhostLens& lens() const { return lens_; }

  // Advances rays of any queue but the ends. count is a multiple of kGhostLanes.
  void advance(const GhostKernels& kernels, int queue, const GhostRay* rays, const GhostChoice& choice,
               GhostChildren& children, int count) const;

 private:
  int surfaces_ = 0;
  std::vector<GhostStep> steps_;
  std::vector<GhostBody> bodies_;
  std::vector<GhostStop> stops_;
  GhostLens lens_{};
};

}  // namespace relign::optics
