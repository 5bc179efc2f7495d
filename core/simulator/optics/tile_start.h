// Where the rays of a tile start. NVRTC compiles this header.
#pragma once

#include "optics/motion.h"
#include "optics/ray_ops.h"

namespace relign::optics {

// World to a tile's first frame, for rays that start at sensor places relative to `centre` (world).
inline void set_first_frame(TileStart& start, const Motion& into_first_frame, const Vec3& centre) {
  for (int i = 0; i < 9; ++i) start.rotation[i] = static_cast<float>(into_first_frame.rotation[i]);
  const Vec3 there = into_first_frame.point(centre);
  start.translation[0] = static_cast<float>(there.x);
  start.translation[1] = static_cast<float>(there.y);
  start.translation[2] = static_cast<float>(there.z);
}

}  // namespace relign::optics
