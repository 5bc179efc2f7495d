// The rays of ray_lanes.h and what its kernels do with them. Compiled for several instruction sets: plain data only, no
// inline functions.
#pragma once

namespace relign::optics {

inline constexpr int kLanes = 64;

// Lens coordinates, mm. Of rays that are not alive only `alive` means anything.
struct alignas(64) RayLanes {
  double x[kLanes], y[kLanes], z[kLanes];
  double dx[kLanes], dy[kLanes], dz[kLanes];  // unit
  double transmittance[kLanes];
  double path_mm[kLanes];  // optical, to here
  double alive[kLanes];    // 1 or 0
  // At the current face, in its coordinates: ray, hit, normal towards +z. Workspace.
  double px[kLanes], py[kLanes], pz[kLanes], lx[kLanes], ly[kLanes], lz[kLanes];
  double hx[kLanes], hy[kLanes], hz[kLanes], nx[kLanes], ny[kLanes], nz[kLanes];
};

struct LaneFace {
  double into[9], into_shift[3];  // lens to element coordinates
  double out[9], out_shift[3];    // and back
  double z_mm;                    // of the vertex, element coordinates
  double curvature, conic;        // conics only
  double clear_mm, stop_mm;       // radii
  double before, behind;          // absolute indices
  double normal_sign;             // -1 behind an odd number of mirrors
  bool mirror;
};

// One set of functions per instruction set, as in ray_block.h; count <= kLanes.
struct LaneKernels {
  // To unit directions; alive where they point towards +z. Transmittance 1, path 0.
  void (*start)(RayLanes& rays, int count);
  // Loses rays that pass the plane at z_mm farther from the axis.
  void (*pass_stop)(RayLanes& rays, double z_mm, double radius_mm, int count);
  void (*enter)(RayLanes& rays, const LaneFace& face, int count);       // p, l
  void (*meet_conic)(RayLanes& rays, const LaneFace& face, int count);  // h, n
  void (*refract)(RayLanes& rays, const LaneFace& face, int count);     // from h, n to the next medium
};

namespace generic {
extern const LaneKernels lane_kernels;
}
namespace avx2 {
extern const LaneKernels lane_kernels;
}
namespace avx512 {
extern const LaneKernels lane_kernels;
}

}  // namespace relign::optics
