// The arithmetic of one ray through an image path, written once: block kernels apply it to blocks of rays
// (block_kernels.cpp), GPU kernels to the ray of a thread (gpu/capture_kernel.h). Here are starts, changes of frame,
// spheres, stops, the look-up of the target and the roulette; conics and polynomials are in asphere_steps.h.
//
// Compiled for several instruction sets and by NVRTC: no library functions, everything inlined. Each operation rounds
// as IEEE 754 says and fma is explicit, so that all of them give the same bits.
#pragma once

#include <relign/philox.hpp>

#include "optics/ray_ops.h"

namespace relign::optics {

template <class Real>
struct RayOf {
  Real x, y, z;       // relative to the current origin, mm
  Real lx, ly, lz;    // direction cosines
  Real above, below;  // transmittance so far = above / below^2
  Real margin;        // smallest distance from any edge so far (ray_block.h); passed if positive
};
using FloatRay = RayOf<float>;

#if defined(__CUDACC_RTC__)
RELIGN_DEVICE float multiply_add(float a, float b, float c) { return __fmaf_rn(a, b, c); }
RELIGN_DEVICE double multiply_add(double a, double b, double c) { return __fma_rn(a, b, c); }
RELIGN_DEVICE float square_root(float a) { return __fsqrt_rn(a); }
RELIGN_DEVICE double square_root(double a) { return __dsqrt_rn(a); }
RELIGN_DEVICE float magnitude(float a) { return fabsf(a); }
RELIGN_DEVICE double magnitude(double a) { return fabs(a); }
#else
RELIGN_DEVICE float multiply_add(float a, float b, float c) { return __builtin_fmaf(a, b, c); }
RELIGN_DEVICE double multiply_add(double a, double b, double c) { return __builtin_fma(a, b, c); }
RELIGN_DEVICE float square_root(float a) { return __builtin_sqrtf(a); }
RELIGN_DEVICE double square_root(double a) { return __builtin_sqrt(a); }
RELIGN_DEVICE float magnitude(float a) { return __builtin_fabsf(a); }
RELIGN_DEVICE double magnitude(double a) { return __builtin_fabs(a); }
#endif
RELIGN_DEVICE float smaller(float a, float b) { return a < b ? a : b; }
RELIGN_DEVICE double smaller(double a, double b) { return a < b ? a : b; }
RELIGN_DEVICE float larger(float a, float b) { return a > b ? a : b; }
RELIGN_DEVICE double larger(double a, double b) { return a > b ? a : b; }

// unit_of_word() uses the upper 24 bits of a word; the four lower bytes make a fifth word.
RELIGN_DEVICE std::uint32_t fifth_word(std::uint32_t c0, std::uint32_t c1, std::uint32_t c2, std::uint32_t c3) {
  return (c0 & 255U) << 24 | (c1 & 255U) << 16 | (c2 & 255U) << 8 | (c3 & 255U);
}

// 24 random bits to [0, 1).
RELIGN_DEVICE float unit_of_word(std::uint32_t bits) {
  return static_cast<float>(static_cast<std::int32_t>(bits >> 8)) * 0x1p-24F;
}

// Uniform on the unit disc from two words: radius sqrt(u), angle 2 pi v. Half the angle is in
// [-pi/2, pi/2), where Taylor series of degree 11 and 12 are good to float; double it afterwards.
RELIGN_DEVICE void unit_disc(std::uint32_t bits_u, std::uint32_t bits_v, float& dx, float& dy) {
  const float radius = square_root(unit_of_word(bits_u));
  const float half = (unit_of_word(bits_v) - 0.5F) * 3.14159265F;
  const float h2 = half * half;
  float sine = multiply_add(h2, -2.50521084e-8F, 2.75573192e-6F);
  sine = multiply_add(h2, sine, -1.98412698e-4F);
  sine = multiply_add(h2, sine, 8.33333333e-3F);
  sine = multiply_add(h2, sine, -1.66666667e-1F);
  sine = multiply_add(h2 * half, sine, half);
  float cosine = multiply_add(h2, 2.08767570e-9F, -2.75573192e-7F);
  cosine = multiply_add(h2, cosine, 2.48015873e-5F);
  cosine = multiply_add(h2, cosine, -1.38888889e-3F);
  cosine = multiply_add(h2, cosine, 4.16666667e-2F);
  cosine = multiply_add(h2, cosine, -0.5F);
  cosine = multiply_add(h2, cosine, 1.0F);
  dx = radius * multiply_add(-2.0F * sine, sine, 1.0F);
  dy = radius * (2.0F * sine * cosine);
}

// From `start` (the path's first frame) along (dx, dy, dz) of any length, which is normalised and turned (row-major
// rotation) in double, then rounded.
RELIGN_DEVICE FloatRay aimed_ray(const double* rotation, float x, float y, float z, double dx, double dy, double dz) {
  const double per_length = 1.0 / square_root(dx * dx + dy * dy + dz * dz);
  const double lx = per_length * dx, ly = per_length * dy, lz = per_length * dz;
  return {x,
          y,
          z,
          static_cast<float>(rotation[0] * lx + rotation[1] * ly + rotation[2] * lz),
          static_cast<float>(rotation[3] * lx + rotation[4] * ly + rotation[5] * lz),
          static_cast<float>(rotation[6] * lx + rotation[7] * ly + rotation[8] * lz),
          1.0F,
          1.0F,
          1.0F};
}

// From a place on the sensor, relative to the tile's centre, with direction cosines p, q.
RELIGN_DEVICE FloatRay placed_ray(const TileStart& tile, float px, float py, float p, float q) {
  const float rest = multiply_add(-p, p, multiply_add(-q, q, 1.0F));
  const float w = -square_root(larger(rest, 1e-12F));
  const float* const r = tile.rotation;
  const float* const t = tile.translation;
  FloatRay ray;
  ray.x = multiply_add(r[0], px, multiply_add(r[1], py, t[0]));
  ray.y = multiply_add(r[3], px, multiply_add(r[4], py, t[1]));
  ray.z = multiply_add(r[6], px, multiply_add(r[7], py, t[2]));
  ray.lx = multiply_add(r[0], p, multiply_add(r[1], q, r[2] * w));
  ray.ly = multiply_add(r[3], p, multiply_add(r[4], q, r[5] * w));
  ray.lz = multiply_add(r[6], p, multiply_add(r[7], q, r[8] * w));
  ray.above = 1.0F;
  ray.below = 1.0F;
  ray.margin = rest;
  return ray;
}

// From random words: place in the pixel with this lower left corner (u0, u1), direction in the tile's ellipse (u2, u3).
RELIGN_DEVICE FloatRay start_in_ellipse(const TileStart& tile, float pixel_x, float pixel_y, std::uint32_t u0,
                                        std::uint32_t u1, std::uint32_t u2, std::uint32_t u3) {
  const float px = multiply_add(unit_of_word(u0), tile.pixel_pitch_x, pixel_x);
  const float py = multiply_add(unit_of_word(u1), tile.pixel_pitch_y, pixel_y);
  float dx = 0, dy = 0;
  unit_disc(u2, u3, dx, dy);
  const float cp = multiply_add(tile.slope[0], px, multiply_add(tile.slope[1], py, tile.centre[0]));
  const float cq = multiply_add(tile.slope[2], px, multiply_add(tile.slope[3], py, tile.centre[1]));
  const float p = multiply_add(tile.axes[0], dx, multiply_add(tile.axes[1], dy, cp));
  const float q = multiply_add(tile.axes[2], dx, multiply_add(tile.axes[3], dy, cq));
  return placed_ray(tile, px, py, p, q);
}

// The same with directions uniform on the whole disc.
RELIGN_DEVICE FloatRay start_in_hemisphere(const TileStart& tile, float pixel_x, float pixel_y, std::uint32_t u0,
                                           std::uint32_t u1, std::uint32_t u2, std::uint32_t u3) {
  const float px = multiply_add(unit_of_word(u0), tile.pixel_pitch_x, pixel_x);
  const float py = multiply_add(unit_of_word(u1), tile.pixel_pitch_y, pixel_y);
  float p = 0, q = 0;
  unit_disc(u2, u3, p, q);
  return placed_ray(tile, px, py, p, q);
}

// The lower left corner of a pixel of a box, counted row by row, relative to the tile's centre (mm), and the pixel's
// number in the frame.
struct PixelStart {
  float x, y;
  std::uint32_t number;
};

// rows_per_pixel: 1 / columns.
RELIGN_DEVICE PixelStart pixel_start(const TileStart& tile, const PixelPlaces& places, float rows_per_pixel,
                                     std::int32_t at) {
  // Half a step above the integer, so that rounding never crosses the next one, for boxes of some hundred pixels.
  const auto row = static_cast<std::int32_t>((static_cast<float>(at) + 0.5F) * rows_per_pixel);
  const std::int32_t column = at - row * places.columns;
  PixelStart start;
  start.x = (static_cast<float>(column) + places.first_column) * tile.pixel_pitch_x;
  start.y = (static_cast<float>(row) + places.first_row) * tile.pixel_pitch_y;
  start.number =
      places.first_number + static_cast<std::uint32_t>(row) * places.frame_width + static_cast<std::uint32_t>(column);
  return start;
}

template <class Real>
RELIGN_DEVICE void apply_frame(RayOf<Real>& ray, const OpOf<Real>& op) {
  const Real x = ray.x, y = ray.y, z = ray.z;
  const Real lx = ray.lx, ly = ray.ly, lz = ray.lz;
  const Real* const r = op.rotation;
  const Real* const t = op.translation;
  ray.x = multiply_add(r[0], x, multiply_add(r[1], y, multiply_add(r[2], z, t[0])));
  ray.y = multiply_add(r[3], x, multiply_add(r[4], y, multiply_add(r[5], z, t[1])));
  ray.z = multiply_add(r[6], x, multiply_add(r[7], y, multiply_add(r[8], z, t[2])));
  ray.lx = multiply_add(r[0], lx, multiply_add(r[1], ly, r[2] * lz));
  ray.ly = multiply_add(r[3], lx, multiply_add(r[4], ly, r[5] * lz));
  ray.lz = multiply_add(r[6], lx, multiply_add(r[7], ly, r[8] * lz));
}

template <class Real>
RELIGN_DEVICE void apply_shift(RayOf<Real>& ray, const OpOf<Real>& op) {
  ray.x += op.translation[0];
  ray.y += op.translation[1];
  ray.z += op.translation[2];
}

// Fresnel: T = 1 - (rs^2 + rp^2) / 2 = 2 r c c' (A^2 + B^2) / (A B)^2 with r the ratio of indices after / before, A = c
// + r c', B = r c + c'.
template <class Real>
RELIGN_DEVICE void transmit(RayOf<Real>& ray, Real back_ratio, Real cosine, Real cosine_after) {
  const Real a = multiply_add(back_ratio, cosine_after, cosine);
  const Real d = multiply_add(back_ratio, cosine, cosine_after);
  ray.above *= Real{2} * back_ratio * cosine * cosine_after * multiply_add(a, a, d * d);
  ray.below *= a * d;
}

// Hit and refraction with the vertex as origin. The distance to the sphere c |h|^2 = 2 h_z from p along l is t = F / (b
// - cosine), F = c |p|^2 - 2 p_z, b = l_z - c (p l), cosine = sqrt(b^2 - c F): the root has the sign of l_z (here
// negative). Snell: Welford, Aberrations of Optical Systems, chapter 4. Roots are of absolute values: where the
// argument is negative, the margin marks the ray as lost.
template <bool Fresnel, class Real>
RELIGN_DEVICE void intersect_face(RayOf<Real>& ray, const OpOf<Real>& op) {
  const Real c = op.curvature, minus_c = -op.curvature, ratio = op.index_ratio;
  const Real minus_ratio2 = -ratio * ratio;
  const Real x = ray.x, y = ray.y, z = ray.z - op.vertex_z;
  const Real lx = ray.lx, ly = ray.ly, lz = ray.lz;
  const Real along = multiply_add(x, lx, multiply_add(y, ly, z * lz));
  const Real square = multiply_add(x, x, multiply_add(y, y, z * z));
  const Real b = multiply_add(minus_c, along, lz);
  const Real f = multiply_add(c, square, -Real{2} * z);
  const Real discriminant = multiply_add(b, b, minus_c * f);
  const Real cosine = square_root(magnitude(discriminant));  // |cos| of incidence
  const Real t = f / (b - cosine);
  const Real hx = multiply_add(t, lx, x);
  const Real hy = multiply_add(t, ly, y);
  const Real hz = multiply_add(t, lz, z);
  const Real refracted = multiply_add(minus_ratio2, multiply_add(-cosine, cosine, Real{1}), Real{1});
  const Real cosine_after = square_root(magnitude(refracted));
  const Real g = multiply_add(ratio, cosine, -cosine_after);  // along the normal, towards -z
  const Real gc = minus_c * g;
  ray.x = hx;
  ray.y = hy;
  ray.z = hz;
  ray.lx = multiply_add(ratio, lx, gc * hx);
  ray.ly = multiply_add(ratio, ly, gc * hy);
  ray.lz = multiply_add(ratio, lz, multiply_add(gc, hz, g));
  const Real edge = multiply_add(-hx, hx, multiply_add(-hy, hy, op.clear_radius2));
  ray.margin = smaller(smaller(ray.margin, edge), smaller(discriminant, refracted));
  if (Fresnel) transmit(ray, op.index_after / op.index_before, cosine, cosine_after);
}

template <class Real>
RELIGN_DEVICE void intersect_stop(RayOf<Real>& ray, const OpOf<Real>& op) {
  const Real z = ray.z - op.vertex_z;
  const Real t = -z / ray.lz;
  const Real x = multiply_add(t, ray.lx, ray.x);
  const Real y = multiply_add(t, ray.ly, ray.y);
  ray.x = x;
  ray.y = y;
  ray.z = Real{0};
  ray.margin = smaller(ray.margin, multiply_add(-x, x, multiply_add(-y, y, op.clear_radius2)));
}

// The barrel's rear rim: a ray that starts behind it must enter within the bore, one that starts inside must start
// within it. Does not move the ray.
template <class Real>
RELIGN_DEVICE void intersect_bore(RayOf<Real>& ray, const OpOf<Real>& op) {
  const Real t = -larger(ray.z - op.vertex_z, Real{0}) / ray.lz;
  const Real x = multiply_add(t, ray.lx, ray.x);
  const Real y = multiply_add(t, ray.ly, ray.y);
  ray.margin = smaller(ray.margin, multiply_add(-x, x, multiply_add(-y, y, op.clear_radius2)));
}

// The Fresnel products grow with every face (25-fold for germanium) and must stay finite in float: after this many
// faces they are replaced by their quotient.
constexpr int kFacesPerProduct = 12;

template <class Real>
RELIGN_DEVICE Real transmittance(const RayOf<Real>& ray) {
  return ray.above / (ray.below * ray.below);
}

template <class Real>
RELIGN_DEVICE void divide_products(RayOf<Real>& ray) {
  ray.above = transmittance(ray);
  ray.below = Real{1};
}

RELIGN_DEVICE float texel_level(std::uint32_t bits, float unit) {
  return static_cast<float>(static_cast<std::int32_t>(bits)) * unit;
}

#if defined(__CUDACC_RTC__)
RELIGN_DEVICE std::uint32_t two_words(const std::uint16_t* words) {
  return static_cast<std::uint32_t>(words[0]) | static_cast<std::uint32_t>(words[1]) << 16;
}
#else
// A word of 32 bits at any even address.
using LooseWord = std::uint32_t __attribute__((aligned(2), may_alias));
RELIGN_DEVICE std::uint32_t two_words(const std::uint16_t* words) { return *reinterpret_cast<const LooseWord*>(words); }
#endif

// x and y become those on the plane, z stays. Returns the distance along the ray.
RELIGN_DEVICE float move_to_plane(FloatRay& ray, float distance_z) {
  const float t = (distance_z - ray.z) / ray.lz;
  ray.x = multiply_add(t, ray.lx, ray.x);
  ray.y = multiply_add(t, ray.ly, ray.y);
  return t;
}

// The four texels around a hit, left and right above, then below, and its place between their centres.
struct TexelPatch {
  float a, b, c, d;
  float fu, fv;
  float free_u, free_v;  // 1; 0 where the outermost texel is repeated
};

RELIGN_DEVICE float value_of(const TexelPatch& patch) {
  const float top = multiply_add(patch.fu, patch.b - patch.a, patch.a);
  const float bottom = multiply_add(patch.fu, patch.d - patch.c, patch.c);
  return multiply_add(patch.fv, bottom - top, top);
}

// Moves a ray to the emitter's plane. False if it was lost or misses the square.
template <bool EightBits>
RELIGN_DEVICE bool find_texels(FloatRay& ray, const EmitterPlane& emitter, TexelPatch& patch) {
  const float last = static_cast<float>(emitter.texels - 1);
  const float t = move_to_plane(ray, emitter.distance_z);
  const float x = ray.x, y = ray.y;
  // The ray must travel forwards and hit inside the square.
  const float inside = smaller(smaller(emitter.half_side - magnitude(x), emitter.half_side - magnitude(y)), t);
  const bool hits = smaller(ray.margin, inside) > 0.0F;
  // Bilinear between texel centres; the border half texel repeats the outermost. NaN goes to 0.
  const float u = hits ? multiply_add(x + emitter.half_side, emitter.texels_per_mm, emitter.texel_offset) : 0.0F;
  const float v = hits ? multiply_add(y + emitter.half_side, emitter.texels_per_mm, emitter.texel_offset) : 0.0F;
  const float uc = smaller(larger(u, 0.0F), last);
  const float vc = smaller(larger(v, 0.0F), last);
  const float u_floor = smaller(static_cast<float>(static_cast<std::int32_t>(uc)), last - 1.0F);
  const float v_floor = smaller(static_cast<float>(static_cast<std::int32_t>(vc)), last - 1.0F);
  patch.fu = uc - u_floor;
  patch.fv = vc - v_floor;
  patch.free_u = uc == u ? 1.0F : 0.0F;
  patch.free_v = vc == v ? 1.0F : 0.0F;
  const std::int32_t at = static_cast<std::int32_t>(v_floor) * emitter.texels + static_cast<std::int32_t>(u_floor);
  if (EightBits) {
    const std::uint32_t four = two_words(emitter.texels_8_bit + at);
    patch.a = texel_level(four & 0xFFU, 1.0F / 255.0F);
    patch.b = texel_level(four >> 16 & 0xFFU, 1.0F / 255.0F);
    patch.c = texel_level(four >> 8 & 0xFFU, 1.0F / 255.0F);
    patch.d = texel_level(four >> 24, 1.0F / 255.0F);
  } else {
    const std::uint32_t upper = emitter.texels_16_bit[at], lower = emitter.texels_16_bit[at + emitter.texels];
    patch.a = texel_level(upper & 0xFFFFU, 1.0F / 65535.0F);
    patch.b = texel_level(upper >> 16, 1.0F / 65535.0F);
    patch.c = texel_level(lower & 0xFFFFU, 1.0F / 65535.0F);
    patch.d = texel_level(lower >> 16, 1.0F / 65535.0F);
  }
  return hits;
}

// Moves a ray to the emitter's plane; the radiance there, 0 if the ray was lost or misses the square.
template <bool EightBits>
RELIGN_DEVICE float look_up(FloatRay& ray, const EmitterPlane& emitter) {
  TexelPatch patch;
  const bool hits = find_texels<EightBits>(ray, emitter, patch);
  const float value = value_of(patch);
  return hits ? value : 0.0F;
}

// Russian roulette on the transmittance, as a share of `bound`, the highest of any ray.
RELIGN_DEVICE bool survives(const FloatRay& ray, std::uint32_t roulette, float bound) {
  return unit_of_word(roulette) * bound * (ray.below * ray.below) < ray.above;
}

}  // namespace relign::optics
