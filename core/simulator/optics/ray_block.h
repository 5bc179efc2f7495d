// Blocks of rays for images: float, structure of arrays, one operation at a time over the block.
//
// For images: millions of rays per second. For golden rays and first-order data use trace.h (double). A ray carries a
// margin: the smallest distance from any edge so far, as a squared length or a discriminant. A ray passed everything if
// and only if its margin is positive.
//
// This header is compiled for several instruction sets: plain data only, no inline functions.
#pragma once

#include <cstdint>

#include "optics/adjoint_block.h"
#include "optics/ghost_block.h"
#include "optics/lane_block.h"
#include "optics/ray_ops.h"

namespace relign::optics {

constexpr int kBlockRays = 256;  // a multiple of 16; 14 arrays of 1 kB stay in the first cache

struct alignas(64) RayBlock {
  // Position relative to the current origin (mm) and direction cosines.
  float x[kBlockRays], y[kBlockRays], z[kBlockRays];
  float lx[kBlockRays], ly[kBlockRays], lz[kBlockRays];
  // Transmittance so far = above / below^2; margin as described above.
  float above[kBlockRays], below[kBlockRays], margin[kBlockRays];
  // Random 32-bit words of a ray: position in the pixel (two), direction (two), Russian roulette.
  std::uint32_t u0[kBlockRays], u1[kBlockRays], u2[kBlockRays], u3[kBlockRays], roulette[kBlockRays];
  // Lower left corner of each ray's pixel, relative to the tile's centre (mm).
  float pixel_x[kBlockRays], pixel_y[kBlockRays];
  // Result: radiance seen, 0 where the ray was lost.
  float radiance[kBlockRays];
  // Steps of intersect_asphere_exactly() so far. Each takes as long as a ray through thirty spherical faces.
  std::uint64_t search_steps;
};

// Distance along a ray to its first intersection with an asphere within the shape radius, in double; finds it for
// certain. False on a miss. p: relative to the vertex. For rays whose Newton steps in the kernels prove nothing.
bool intersect_asphere_exactly(const Op& op, const float (&p)[3], const float (&l)[3], float& t, std::uint64_t& steps);

struct BlockKernels {
  const char* name;
  // u0..u3 from Philox4x32-10: counter (sample[i], pixel[i], stream, 0), key; roulette from their lower bytes. count a
  // multiple of 16, as everywhere here.
  void (*philox)(RayBlock& block, const std::uint32_t* pixel, const std::uint32_t* sample, std::uint32_t stream,
                 std::uint32_t key0, std::uint32_t key1, int count);
  // Starts rays on the sensor from u0..u3 (position in the pixel, direction in the ellipse); above = below = 1.
  void (*start_in_ellipse)(RayBlock& block, const TileStart& tile, int count);
  // The same with directions uniform on the whole unit disc (cosine-weighted hemisphere).
  void (*start_in_hemisphere)(RayBlock& block, const TileStart& tile, int count);
  // Starts rays at `start` along x - from.x, y - from.y, z - from.z, which are normalised and turned (rotation,
  // row-major) in double, then rounded; above = below = margin = 1.
  void (*aim)(RayBlock& block, const double (&rotation)[9], const double (&start)[3], const double (&from)[3],
              const double* x, const double* y, const double* z, int count);
  void (*trace)(RayBlock& block, const Op* ops, int op_count, bool fresnel, int count);
  // The same, with the state of every ray before each operation and at the end: (op_count + 1) x kStateNumbers x
  // kBlockRays.
  void (*trace_recorded)(RayBlock& block, const Op* ops, int op_count, bool fresnel, int count, float* record);
  // Moves rays to the emitter's plane and looks up its radiance; x, y become those of the hit.
  void (*look_up)(RayBlock& block, const EmitterPlane& emitter, int count);
  // radiance *= above / below^2.
  void (*apply_transmittance)(RayBlock& block, int count);
  // counts[i] = number of the ascending thresholds that words[i] reaches.
  void (*count_reached)(const std::uint32_t* words, const std::uint32_t* thresholds, int levels, std::uint32_t* counts,
                        int count);
  // Russian roulette on the transmittance: radiance stays where r * below^2 * bound < above, with r in [0, 1) from the
  // roulette word; else 0.
  void (*play_roulette)(RayBlock& block, float bound, int count);
  // Rays `first` to first + count of runs of equal length, one run per pixel: owner = run, sample = position in it.
  void (*equal_runs)(std::uint32_t* owner, std::uint32_t* sample, std::uint32_t first, int length, int count);
  // pixel_x, pixel_y and the frame's pixel number of each ray's owner, an index into a box of pixels, row by row.
  void (*take_pixels)(RayBlock& block, const TileStart& tile, const PixelPlaces& places, const std::uint32_t* owner,
                      std::uint32_t* number, int count);
  // u0..u3 = shift[k][owner] + sample * step[k]: a lattice, shifted for each pixel.
  void (*lattice)(RayBlock& block, const std::uint32_t* owner, const std::uint32_t* sample,
                  const std::uint32_t* const* shift, const std::uint32_t* step, int count);
  // sums[i] = sum of radiance over the rays i * length to (i + 1) * length, in an order that is the same on
  // every instruction set. length: 8 to kBlockRays, a power of two.
  void (*sum_runs)(const RayBlock& block, int length, float* sums, int count);
  const AdjointKernels* adjoints;
  const GhostKernels* ghosts;
  const LaneKernels* lanes;
};

namespace generic {
const BlockKernels& kernels();
}
namespace avx2 {
const BlockKernels& kernels();
}
namespace avx512 {
const BlockKernels& kernels();
}

// The fastest set this processor has. RELIGN_ISA=generic|avx2|avx512 in the environment chooses a slower one (for
// tests; throws if the processor lacks it).
const BlockKernels& block_kernels();
// By name; null when the processor cannot run it.
const BlockKernels* block_kernels(const char* name);

}  // namespace relign::optics
