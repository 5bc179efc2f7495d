// Derivatives of a block of rays in reverse: the rays are traced with a record of every state, and then back, once,
// whatever the number of parts whose motion is asked for. Compiled for several instruction sets: plain data only, no
// inline functions.
#pragma once

#include <cstdint>

#include "optics/ray_ops.h"

namespace relign::optics {

struct RayBlock;

constexpr int kStateNumbers = 6, kWrenchNumbers = 6;

// A place between two operations where adjoints (adjoint_steps.h) are kept.
struct ReadingPlace {
  std::int32_t before;  // this operation; op_count: behind the last
  float rotation[9];    // the frame there -> lens, row-major
  float translation[3];
};

// A plane of the lens that holds the exit pupil, normal * p = distance, in the first frame of a path. Its points follow
// the lens, and with them the rays of a pixel.
struct PupilPlane {
  float normal[3];  // along the axis
  float distance;   // mm
  float across[3];  // the normal of the sensor
};

// The sensor behind a block, in the first frame of a path.
struct SensorView {
  float u[3], v[3];  // from pixel to pixel, mm, signed as TileStart's pitch
  float cells;       // of a pixel, along u and along v: see mean_slope()
  PupilPlane pupil;
};

// What is traced back: x and y of the hit on the emitter's plane, and the logarithm of the light.
constexpr int kTracedBack = 3;
constexpr int kPlaceNumbers = kTracedBack * kStateNumbers;

// A part between two places: it moves, and what is outside does not.
struct PartBetween {
  std::int32_t into, out;
};

// Numbers of a block are arrays of kBlockRays (ray_block.h).
struct AdjointKernels {
  // From the emitter's plane at distance_z back to the sensor. record: of trace_recorded. places: ascending; the first
  // is the sensor. adjoints: place_count x kPlaceNumbers arrays.
  void (*trace_back)(const Op* ops, int op_count, bool fresnel, const float* record, float distance_z,
                     const ReadingPlace* places, int place_count, float* adjoints, int count);
  // block: as look_up left it. Derivative of the value of each ray, radiance times transmittance (if `fresnel`) over
  // `bound`, by the motion of each part: part_count x kWrenchNumbers arrays, per mm and per rad about the lens's
  // origin; 0 for rays that were lost. follow: if not null, the first part is the lens, and its rays move with the
  // pupil.
  void (*differentiate)(const RayBlock& block, const EmitterPlane& emitter, bool fresnel, float bound,
                        const float* record, const float* adjoints, const SensorView& view, const ReadingPlace* places,
                        const PartBetween* parts, int part_count, const PupilPlane* follow, float* derivatives,
                        int count);
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
