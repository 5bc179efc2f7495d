// What the kernels are given: the operations of a light path, where rays start, and the emitter's plane. Plain data of
// fixed sizes, compiled for several instruction sets and by NVRTC for GPUs.
#pragma once

#include <cstdint>

#include "optics/face_rings.h"

namespace relign::optics {

constexpr int kEvenTerms = 16, kOddTerms = 8;  // at most: r^2 to r^32, r^3 to r^17

// One operation on rays on their way from the sensor to the emitter (they travel towards -z).
struct OpKinds {
  // face: a sphere or plane; asphere: a conic, with or without a polynomial.
  enum Kind : std::int32_t { frame, shift, face, asphere, stop, bore };
};
template <class Real>
struct OpOf : OpKinds {
  Kind kind;
  // frame: rotation (row-major) and translation, p' = R p + t. shift: t only.
  Real rotation[9];
  Real translation[3];
  // face and stop: z of the vertex in the current frame; the origin moves there.
  Real vertex_z;
  Real curvature;     // 1 / radius, 0 for a plane
  Real index_before;  // of the medium the ray comes from
  Real index_after;
  Real index_ratio;    // before / after
  Real clear_radius2;  // face, stop, bore: square of the radius that lets light through
  // asphere: 1 + k; the polynomial's terms over q = (r / shape radius)^2, in mm: of q, q^2, ... and of q^1.5, q^2.5,
  // ...; whether the even ones are over the conic's root s (face_shape.h). Terms and bounds (face_shape.h) hold up to
  // shape_radius.
  Real conic_plus_1;
  Real shape_radius, per_shape_radius2;
  std::int32_t even_terms, odd_terms, over_root;
  Real even[kEvenTerms], odd[kOddTerms];
  Real lowest, highest, steepest, most_bent;
  Real near_vertex, near_curvature, near_conic_plus_1;  // the conic that steps start from
  const FaceRings* rings;                               // of a face with a polynomial; owned by the path
};
using Op = OpOf<float>;
using ExactOp = OpOf<double>;

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

}  // namespace relign::optics
