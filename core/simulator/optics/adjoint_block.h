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

// What is traced back: x and y of the hit on the emitter's plane, and the logarithm of the light (adjoint_steps.h).
constexpr int kTracedBack = 3;
constexpr int kPlaceNumbers = kTracedBack * kWrenchNumbers;

// How the pixels lie behind a block.
struct PixelSteps {
  float x[3], y[3];        // world x and y in lens coordinates
  float pitch_x, pitch_y;  // mm, signed as TileStart's
};

// A part between two places: it moves, and what is outside does not.
struct PartBetween {
  std::int32_t into, out;
};

// Numbers of a block are arrays of kBlockRays (ray_block.h).
struct AdjointKernels {
  // From the emitter's plane at distance_z back to the sensor. record: of trace_recorded. wrenches: place_count x
  // kPlaceNumbers arrays. places: ascending; the first is the sensor. follow: if not null, the second is the sensor once
  // more, and there what changes because rays move with the pupil is subtracted.
  void (*trace_back)(const Op* ops, int op_count, bool fresnel, const float* record, float distance_z,
                     const ReadingPlace* places, int place_count, const PupilPlane* follow, float* wrenches, int count);
  // block: as look_up left it. Derivative of the value of each ray, radiance times transmittance (if `fresnel`) over
  // `bound`, by the motion of each part: part_count x kWrenchNumbers arrays, per mm and per rad about the lens's origin;
  // 0 for rays that were lost.
  void (*differentiate)(const RayBlock& block, const EmitterPlane& emitter, bool fresnel, float bound,
                        const PixelSteps& steps, const float* at_sensor, const float* wrenches,
                        const PartBetween* parts, int part_count, float* derivatives, int count);
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
