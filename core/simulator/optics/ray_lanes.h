// Sequential tracing of many rays at once, in double, with the same bits as trace(): for spots and MTF by rays. Rays
// carry no hits and no reasons; trace.h has those of a single ray.
#pragma once

#include <cstddef>
#include <vector>

#include "optics/assembly.h"
#include "optics/lane_block.h"

namespace relign::optics {

// The operations of trace() with Apertures::mesh for one lens as built.
class LanePath {
 public:
  // `assembly` must outlive it.
  explicit LanePath(const Assembly& assembly);
  // From x, y, z along dx, dy, dz (any length) to the last face; kernels: those of block_kernels(). Thread-safe.
  void trace(RayLanes& rays, int count, const LaneKernels& kernels) const;

 private:
  struct Step {
    bool is_stop = false;
    double z_mm = 0, radius_mm = 0;  // of the stop
    LaneFace face{};
    const Face* polynomial = nullptr;  // null: a conic
    const FaceBounds* bounds = nullptr;
  };
  void pass_stops_before(std::size_t face, const Prescription& lens);

  std::vector<Step> steps_;
  double last_index_ = 1;
};

}  // namespace relign::optics
