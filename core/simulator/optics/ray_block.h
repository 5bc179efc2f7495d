// Blocks of rays for images: float, structure of arrays, one operation at a time over the block.
//
// For images: millions of rays per second. For golden rays and first-order data use trace.h (double). A ray carries a
// margin: the smallest distance from any edge so far, as a squared length or a discriminant. A ray passed everything if
// and only if its margin is positive.
//
// This header is compiled for several instruction sets: plain data only, no inline functions.
#pragma once

#include <cstdint>

#include "optics/face_rings.h"
#include "optics/ghost_block.h"
#include "optics/lane_block.h"

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
};

constexpr int kEvenTerms = 16, kOddTerms = 8;  // at most: r^2 to r^32, r^3 to r^17

// One operation on rays on their way from the sensor to the emitter (they travel towards -z).
struct Op {
  // face: a sphere or plane; asphere: a conic, with or without a polynomial.
  enum Kind : std::int32_t { frame, shift, face, asphere, stop, bore };
  Kind kind;
  // frame: rotation (row-major) and translation, p' = R p + t. shift: t only.
  float rotation[9];
  float translation[3];
  // face and stop: z of the vertex in the current frame; the origin moves there.
  float vertex_z;
  float curvature;     // 1 / radius, 0 for a plane
  float index_before;  // of the medium the ray comes from
  float index_after;
  float index_ratio;    // before / after
  float clear_radius2;  // face, stop, bore: square of the radius that lets light through
  // asphere: 1 + k; the polynomial's terms over q = (r / shape radius)^2, in mm: of q, q^2, ... and of q^1.5, q^2.5,
  // ...; whether the even ones are over the conic's root s (face_shape.h). Terms and bounds (face_shape.h) hold up to
  // shape_radius.
  float conic_plus_1;
  float shape_radius, per_shape_radius2;
  std::int32_t even_terms, odd_terms, over_root;
  float even[kEvenTerms], odd[kOddTerms];
  float lowest, highest, steepest, most_bent;
  float near_vertex, near_curvature, near_conic_plus_1;  // the conic that steps start from
  const FaceRings* rings;                                // of a face with a polynomial; owned by the path
};

// Distance along a ray to its first intersection with an asphere within the shape radius, in double; finds it for
// certain. False on a miss. p: relative to the vertex. For rays whose Newton steps in the kernels prove nothing.
bool intersect_asphere_exactly(const Op& op, const float (&p)[3], const float (&l)[3], float& t);

// Uniform directions in an ellipse of direction cosines whose centre moves with the position on the sensor: (p, q) =
// centre + slope (x, y) + axes (unit disc). p, q along world x, y; light comes from -z.
struct TileStart {
  float pixel_pitch_x, pixel_pitch_y;  // mm, signed as x and y grow with column and row
  float centre[2];
  float slope[4];  // row-major
  float axes[4];   // row-major, lower triangular
  // World (origin at tile centre on the sensor) to the first frame of the path.
  float rotation[9];
  float translation[3];
};

// A box of pixels within a tile.
struct PixelPlaces {
  std::int32_t columns;           // of the box
  float first_column, first_row;  // of the box, counted from the tile's centre, in pixels
  std::uint32_t first_number;     // of the box's first pixel in the frame
  std::uint32_t frame_width;      // pixels
};

struct EmitterPlane {
  float distance_z;  // z of the plane in the current frame, mm
  float half_side;   // mm
  float texels_per_mm;
  std::int32_t texels;  // per side
  // texels x texels, row 0 at y = -half_side, and one word of padding behind. One of the two, the other is null:
  // 8-bit texels (255 = radiance 1), each with the one below it in the upper half of its word; or 16-bit texels
  // (65535 = radiance 1), each with its right neighbour in the upper half. One look-up of 32 bits at any word of the
  // first, or two in the second, give the four texels of a bilinear value.
  const std::uint16_t* texels_8_bit;
  const std::uint32_t* texels_16_bit;
  // Added to a position in texels: -0.5; 0.5 if the bitmap's outermost texels are a frame around the square.
  float texel_offset = -0.5F;
};

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
  void (*trace)(RayBlock& block, const Op* ops, int op_count, bool fresnel, int count);
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
