// Derivatives of a block of rays in reverse: the rays are traced with a record of every state, and then back, once,
// whatever the number of parts whose motion is asked for. Compiled for several instruction sets: plain data only, no
// inline functions.
#pragma once

#include <cstdint>

#include "optics/ray_ops.h"

namespace relign::optics {

struct RayBlock;

constexpr int kStateNumbers = 6, kWrenchNumbers = 6;

// A place between two operations where a wrench (adjoint_steps.h) is read off, in the coordinates of the lens.
struct ReadingPlace {
  std::int32_t before;    // this operation; op_count: behind the last
  float rotation[9];      // the frame there -> lens, row-major
  float translation[3];
};

// A plane of the lens that holds the exit pupil. Its points follow the lens, and with them the rays of a pixel.
struct PupilPlane {
  float z;          // lens coordinates, mm
  float across[3];  // the normal of the sensor in lens coordinates, unit
};

// Numbers of a block are arrays of kBlockRays (ray_block.h).
struct AdjointKernels {
  // What BlockKernels::look_up does, with the slopes of the radiance at the hit (1/mm). At the border of the square,
  // within `edge_width` (mm) inside it, they contain what its motion lets in or out.
  void (*look_up_slopes)(RayBlock& block, const EmitterPlane& emitter, float edge_width, float* slope_x, float* slope_y,
                         int count);
  // From the emitter's plane at distance_z back to the sensor. record: of trace_recorded; slopes: of F, the value of a
  // ray; value: F, of which the transmittance is a factor. wrenches: place_count x kWrenchNumbers x kBlockRays, dF per mm
  // and per rad about the lens's origin; 0 for rays that were lost (margin). follow: if not null, what F changes by
  // because rays move with the pupil is subtracted from the first wrench.
  void (*trace_back)(const RayBlock& block, const Op* ops, int op_count, bool fresnel, const float* record,
                     float distance_z, const float* slope_x, const float* slope_y, const float* value,
                     const ReadingPlace* places, int place_count, const PupilPlane* follow, float* wrenches, int count);
};

namespace generic {
extern const AdjointKernels adjoint_kernels;
}
namespace avx2 {
extern const AdjointKernels adjoint_kernels;
}
namespace avx512 {
extern const AdjointKernels adjoint_kernels;
}

}  // namespace relign::optics
