// The float kernels of ray_block.h, compiled once for each instruction set (RELIGN_KERNEL_ISA).
//
// Each operation is a function of its own with plain loops over arrays and scalar locals: that is
// what the compiler vectorises. Only builtins and intrinsics are called, so that no inline function of
// a library header is emitted here with instructions that other code must not run.
#if defined(__AVX2__)
#include <immintrin.h>
#endif

#include "optics/ray_block.h"

namespace relign::optics {
namespace RELIGN_KERNEL_ISA {
namespace {

#define RELIGN_LOOP _Pragma("omp simd")

inline float multiply_add(float a, float b, float c) { return __builtin_fmaf(a, b, c); }
inline float smaller(float a, float b) { return a < b ? a : b; }
inline float larger(float a, float b) { return a > b ? a : b; }

// unit() uses the upper 24 bits of a word; the four lower bytes make a fifth word.
inline std::uint32_t fifth_word(std::uint32_t c0, std::uint32_t c1, std::uint32_t c2, std::uint32_t c3) {
  return (c0 & 255U) << 24 | (c1 & 255U) << 16 | (c2 & 255U) << 8 | (c3 & 255U);
}

// The rounds of Philox4x32-10 on 64-bit lanes, of which only the lower halves count: one instruction
// gives a full product, and what it leaves in the upper halves is ignored by the next.
#if defined(__AVX512F__)
constexpr int kWideLanes = 8;
using Wide = __m512i;
inline Wide wide(std::uint32_t word) { return _mm512_set1_epi64(static_cast<long long>(word)); }
inline Wide load_wide(const std::uint32_t* words) {
  return _mm512_cvtepu32_epi64(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(words)));
}
inline void store_narrow(std::uint32_t* words, Wide lanes) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(words), _mm512_cvtepi64_epi32(lanes));
}
inline Wide product(Wide a, Wide b) { return _mm512_mul_epu32(a, b); }
inline Wide upper_half(Wide a) { return _mm512_srli_epi64(a, 32); }
inline Wide exclusive_or(Wide a, Wide b, Wide c) { return _mm512_ternarylogic_epi64(a, b, c, 0x96); }
#elif defined(__AVX2__)
constexpr int kWideLanes = 4;
using Wide = __m256i;
inline Wide wide(std::uint32_t word) { return _mm256_set1_epi64x(static_cast<long long>(word)); }
inline Wide load_wide(const std::uint32_t* words) {
  return _mm256_cvtepu32_epi64(_mm_loadu_si128(reinterpret_cast<const __m128i*>(words)));
}
inline void store_narrow(std::uint32_t* words, Wide lanes) {
  const __m256i packed = _mm256_permutevar8x32_epi32(lanes, _mm256_setr_epi32(0, 2, 4, 6, 0, 2, 4, 6));
  _mm_storeu_si128(reinterpret_cast<__m128i*>(words), _mm256_castsi256_si128(packed));
}
inline Wide product(Wide a, Wide b) { return _mm256_mul_epu32(a, b); }
inline Wide upper_half(Wide a) { return _mm256_srli_epi64(a, 32); }
inline Wide exclusive_or(Wide a, Wide b, Wide c) { return _mm256_xor_si256(_mm256_xor_si256(a, b), c); }
#else
constexpr int kWideLanes = 1;
using Wide = std::uint64_t;
inline Wide wide(std::uint32_t word) { return word; }
inline Wide load_wide(const std::uint32_t* words) { return *words; }
inline void store_narrow(std::uint32_t* words, Wide lanes) { *words = static_cast<std::uint32_t>(lanes); }
inline Wide product(Wide a, Wide b) { return (a & 0xFFFFFFFFU) * (b & 0xFFFFFFFFU); }
inline Wide upper_half(Wide a) { return a >> 32; }
inline Wide exclusive_or(Wide a, Wide b, Wide c) { return a ^ b ^ c; }
#endif

void philox(RayBlock& block, const std::uint32_t* pixel, const std::uint32_t* sample, std::uint32_t stream,
            std::uint32_t key0, std::uint32_t key1, int count) {
  const Wide multiplier0 = wide(0xD2511F53U), multiplier1 = wide(0xCD9E8D57U);
  for (int i = 0; i < count; i += kWideLanes) {
    Wide c0 = load_wide(sample + i), c1 = load_wide(pixel + i), c2 = wide(stream), c3 = wide(0);
    std::uint32_t k0 = key0, k1 = key1;
    for (int round = 0; round < 10; ++round) {
      const Wide product0 = product(multiplier0, c0);
      const Wide product1 = product(multiplier1, c2);
      c0 = exclusive_or(upper_half(product1), c1, wide(k0));
      c1 = product1;
      c2 = exclusive_or(upper_half(product0), c3, wide(k1));
      c3 = product0;
      k0 += 0x9E3779B9U;
      k1 += 0xBB67AE85U;
    }
    store_narrow(block.u0 + i, c0);
    store_narrow(block.u1 + i, c1);
    store_narrow(block.u2 + i, c2);
    store_narrow(block.u3 + i, c3);
  }
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) block.roulette[i] = fifth_word(block.u0[i], block.u1[i], block.u2[i], block.u3[i]);
}

// 24 random bits to [0, 1).
inline float unit(std::uint32_t bits) { return static_cast<float>(static_cast<std::int32_t>(bits >> 8)) * 0x1p-24F; }

// Uniform on the unit disc from two words: radius sqrt(u), angle 2 pi v. Half the angle is in
// [-pi/2, pi/2), where Taylor series of degree 11 and 12 are good to float; double it afterwards.
inline void unit_disc(std::uint32_t bits_u, std::uint32_t bits_v, float& dx, float& dy) {
  const float radius = __builtin_sqrtf(unit(bits_u));
  const float half = (unit(bits_v) - 0.5F) * 3.14159265F;
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

inline void place_ray(RayBlock& block, const TileStart& tile, int i, float px, float py, float p, float q) {
  const float rest = multiply_add(-p, p, multiply_add(-q, q, 1.0F));
  const float w = -__builtin_sqrtf(larger(rest, 1e-12F));
  const float* const r = tile.rotation;
  const float* const t = tile.translation;
  block.x[i] = multiply_add(r[0], px, multiply_add(r[1], py, t[0]));
  block.y[i] = multiply_add(r[3], px, multiply_add(r[4], py, t[1]));
  block.z[i] = multiply_add(r[6], px, multiply_add(r[7], py, t[2]));
  block.lx[i] = multiply_add(r[0], p, multiply_add(r[1], q, r[2] * w));
  block.ly[i] = multiply_add(r[3], p, multiply_add(r[4], q, r[5] * w));
  block.lz[i] = multiply_add(r[6], p, multiply_add(r[7], q, r[8] * w));
  block.above[i] = 1.0F;
  block.below[i] = 1.0F;
  block.margin[i] = rest;
}

void start_in_ellipse(RayBlock& block, const TileStart& given, int count) {
  const TileStart tile = given;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float px = multiply_add(unit(block.u0[i]), tile.pixel_pitch_x, block.pixel_x[i]);
    const float py = multiply_add(unit(block.u1[i]), tile.pixel_pitch_y, block.pixel_y[i]);
    float dx = 0, dy = 0;
    unit_disc(block.u2[i], block.u3[i], dx, dy);
    const float cp = multiply_add(tile.slope[0], px, multiply_add(tile.slope[1], py, tile.centre[0]));
    const float cq = multiply_add(tile.slope[2], px, multiply_add(tile.slope[3], py, tile.centre[1]));
    const float p = multiply_add(tile.axes[0], dx, multiply_add(tile.axes[1], dy, cp));
    const float q = multiply_add(tile.axes[2], dx, multiply_add(tile.axes[3], dy, cq));
    place_ray(block, tile, i, px, py, p, q);
  }
}

void start_in_hemisphere(RayBlock& block, const TileStart& given, int count) {
  const TileStart tile = given;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float px = multiply_add(unit(block.u0[i]), tile.pixel_pitch_x, block.pixel_x[i]);
    const float py = multiply_add(unit(block.u1[i]), tile.pixel_pitch_y, block.pixel_y[i]);
    float p = 0, q = 0;
    unit_disc(block.u2[i], block.u3[i], p, q);
    place_ray(block, tile, i, px, py, p, q);
  }
}

void apply_frame(RayBlock& block, const Op& op, int count) {
  const float r0 = op.rotation[0], r1 = op.rotation[1], r2 = op.rotation[2];
  const float r3 = op.rotation[3], r4 = op.rotation[4], r5 = op.rotation[5];
  const float r6 = op.rotation[6], r7 = op.rotation[7], r8 = op.rotation[8];
  const float t0 = op.translation[0], t1 = op.translation[1], t2 = op.translation[2];
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float x = block.x[i], y = block.y[i], z = block.z[i];
    const float lx = block.lx[i], ly = block.ly[i], lz = block.lz[i];
    block.x[i] = multiply_add(r0, x, multiply_add(r1, y, multiply_add(r2, z, t0)));
    block.y[i] = multiply_add(r3, x, multiply_add(r4, y, multiply_add(r5, z, t1)));
    block.z[i] = multiply_add(r6, x, multiply_add(r7, y, multiply_add(r8, z, t2)));
    block.lx[i] = multiply_add(r0, lx, multiply_add(r1, ly, r2 * lz));
    block.ly[i] = multiply_add(r3, lx, multiply_add(r4, ly, r5 * lz));
    block.lz[i] = multiply_add(r6, lx, multiply_add(r7, ly, r8 * lz));
  }
}

void apply_shift(RayBlock& block, const Op& op, int count) {
  const float t0 = op.translation[0], t1 = op.translation[1], t2 = op.translation[2];
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    block.x[i] += t0;
    block.y[i] += t1;
    block.z[i] += t2;
  }
}

// Hit and refraction with the vertex as origin. The distance to the sphere c |h|^2 = 2 h_z from p along l is t = F / (b
// - cosine), F = c |p|^2 - 2 p_z, b = l_z - c (p l), cosine = sqrt(b^2 - c F): the root has the sign of l_z (here
// negative). Snell: Welford, Aberrations of Optical Systems, chapter 4. Fresnel: T = 1 - (rs^2 + rp^2) / 2 = 2 r c c'
// (A^2 + B^2) / (A B)^2 with r the ratio of indices after / before, A = c + r c', B = r c + c'. Roots are of absolute
// values: where the argument is negative, the margin marks the ray as lost.
inline void transmit(RayBlock& block, int i, float back_ratio, float cosine, float cosine_after) {
  const float a = multiply_add(back_ratio, cosine_after, cosine);
  const float d = multiply_add(back_ratio, cosine, cosine_after);
  block.above[i] *= 2.0F * back_ratio * cosine * cosine_after * multiply_add(a, a, d * d);
  block.below[i] *= a * d;
}

template <bool Fresnel>
void intersect_face(RayBlock& block, const Op& op, int count) {
  const float vertex = op.vertex_z, c = op.curvature, minus_c = -op.curvature;
  const float ratio = op.index_ratio, clear2 = op.clear_radius2;
  const float minus_ratio2 = -ratio * ratio;
  const float back_ratio = op.index_after / op.index_before;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float x = block.x[i], y = block.y[i], z = block.z[i] - vertex;
    const float lx = block.lx[i], ly = block.ly[i], lz = block.lz[i];
    const float along = multiply_add(x, lx, multiply_add(y, ly, z * lz));
    const float square = multiply_add(x, x, multiply_add(y, y, z * z));
    const float b = multiply_add(minus_c, along, lz);
    const float f = multiply_add(c, square, -2.0F * z);
    const float discriminant = multiply_add(b, b, minus_c * f);
    const float cosine = __builtin_sqrtf(__builtin_fabsf(discriminant));  // |cos| of incidence
    const float t = f / (b - cosine);
    const float hx = multiply_add(t, lx, x);
    const float hy = multiply_add(t, ly, y);
    const float hz = multiply_add(t, lz, z);
    const float refracted = multiply_add(minus_ratio2, multiply_add(-cosine, cosine, 1.0F), 1.0F);
    const float cosine_after = __builtin_sqrtf(__builtin_fabsf(refracted));
    const float g = multiply_add(ratio, cosine, -cosine_after);  // along the normal, towards -z
    const float gc = minus_c * g;
    block.x[i] = hx;
    block.y[i] = hy;
    block.z[i] = hz;
    block.lx[i] = multiply_add(ratio, lx, gc * hx);
    block.ly[i] = multiply_add(ratio, ly, gc * hy);
    block.lz[i] = multiply_add(ratio, lz, multiply_add(gc, hz, g));
    const float edge = multiply_add(-hx, hx, multiply_add(-hy, hy, clear2));
    block.margin[i] = smaller(smaller(block.margin[i], edge), smaller(discriminant, refracted));
    if (Fresnel) transmit(block, i, back_ratio, cosine, cosine_after);
  }
}

#include "optics/block_asphere.inc"

void intersect_stop(RayBlock& block, const Op& op, int count) {
  const float vertex = op.vertex_z, clear2 = op.clear_radius2;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float z = block.z[i] - vertex;
    const float t = -z / block.lz[i];
    const float x = multiply_add(t, block.lx[i], block.x[i]);
    const float y = multiply_add(t, block.ly[i], block.y[i]);
    block.x[i] = x;
    block.y[i] = y;
    block.z[i] = 0.0F;
    block.margin[i] = smaller(block.margin[i], multiply_add(-x, x, multiply_add(-y, y, clear2)));
  }
}

// The barrel's rear rim: a ray that starts behind it must enter within the bore, one that starts inside must start
// within it. Does not move the ray.
void intersect_bore(RayBlock& block, const Op& op, int count) {
  const float rim = op.vertex_z, clear2 = op.clear_radius2;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float t = -larger(block.z[i] - rim, 0.0F) / block.lz[i];
    const float x = multiply_add(t, block.lx[i], block.x[i]);
    const float y = multiply_add(t, block.ly[i], block.y[i]);
    block.margin[i] = smaller(block.margin[i], multiply_add(-x, x, multiply_add(-y, y, clear2)));
  }
}

// The Fresnel products grow with every face (25-fold for germanium) and must stay finite in float: after this many
// faces they are replaced by their quotient.
constexpr int kFacesPerProduct = 12;

void divide_products(RayBlock& block, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    block.above[i] /= block.below[i] * block.below[i];
    block.below[i] = 1.0F;
  }
}

void trace(RayBlock& block, const Op* ops, int op_count, bool fresnel, int count) {
  int faces = 0;
  for (int k = 0; k < op_count; ++k) {
    const Op op = ops[k];
    if (fresnel && (op.kind == Op::face || op.kind == Op::asphere) && ++faces > kFacesPerProduct) {
      divide_products(block, count);
      faces = 1;
    }
    switch (op.kind) {
      case Op::frame:
        apply_frame(block, op, count);
        break;
      case Op::shift:
        apply_shift(block, op, count);
        break;
      case Op::face:
        if (fresnel)
          intersect_face<true>(block, op, count);
        else
          intersect_face<false>(block, op, count);
        break;
      case Op::asphere:
        if (fresnel)
          intersect_asphere<true>(block, op, count);
        else
          intersect_asphere<false>(block, op, count);
        break;
      case Op::stop:
        intersect_stop(block, op, count);
        break;
      case Op::bore:
        intersect_bore(block, op, count);
        break;
    }
  }
}

inline float level(std::uint32_t bits, float unit) {
  return static_cast<float>(static_cast<std::int32_t>(bits)) * unit;
}

// A word of 32 bits at any even address.
using LooseWord = std::uint32_t __attribute__((aligned(2), may_alias));

template <bool EightBits>
void look_up_texels(RayBlock& block, const EmitterPlane& given, int count) {
  const EmitterPlane emitter = given;
  const float last = static_cast<float>(emitter.texels - 1);
  const std::uint16_t* const narrow = emitter.texels_8_bit;
  const std::uint32_t* const broad = emitter.texels_16_bit;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float t = (emitter.distance_z - block.z[i]) / block.lz[i];
    const float x = multiply_add(t, block.lx[i], block.x[i]);
    const float y = multiply_add(t, block.ly[i], block.y[i]);
    block.x[i] = x;
    block.y[i] = y;
    // The ray must travel forwards and hit inside the square.
    const float inside =
        smaller(smaller(emitter.half_side - __builtin_fabsf(x), emitter.half_side - __builtin_fabsf(y)), t);
    const bool hits = smaller(block.margin[i], inside) > 0.0F;
    // Bilinear between texel centres; the border half texel repeats the outermost. NaN goes to 0.
    const float u = hits ? multiply_add(x + emitter.half_side, emitter.texels_per_mm, emitter.texel_offset) : 0.0F;
    const float v = hits ? multiply_add(y + emitter.half_side, emitter.texels_per_mm, emitter.texel_offset) : 0.0F;
    const float uc = smaller(larger(u, 0.0F), last);
    const float vc = smaller(larger(v, 0.0F), last);
    const float u_floor = smaller(static_cast<float>(static_cast<std::int32_t>(uc)), last - 1.0F);
    const float v_floor = smaller(static_cast<float>(static_cast<std::int32_t>(vc)), last - 1.0F);
    const float fu = uc - u_floor;
    const float fv = vc - v_floor;
    const std::int32_t at = static_cast<std::int32_t>(v_floor) * emitter.texels + static_cast<std::int32_t>(u_floor);
    float a = 0, b = 0, c = 0, d = 0;  // left and right above, then below
    if (EightBits) {
      const std::uint32_t four = *reinterpret_cast<const LooseWord*>(narrow + at);
      a = level(four & 0xFFU, 1.0F / 255.0F);
      b = level(four >> 16 & 0xFFU, 1.0F / 255.0F);
      c = level(four >> 8 & 0xFFU, 1.0F / 255.0F);
      d = level(four >> 24, 1.0F / 255.0F);
    } else {
      const std::uint32_t upper = broad[at], lower = broad[at + emitter.texels];
      a = level(upper & 0xFFFFU, 1.0F / 65535.0F);
      b = level(upper >> 16, 1.0F / 65535.0F);
      c = level(lower & 0xFFFFU, 1.0F / 65535.0F);
      d = level(lower >> 16, 1.0F / 65535.0F);
    }
    const float top = multiply_add(fu, b - a, a);
    const float bottom = multiply_add(fu, d - c, c);
    const float value = multiply_add(fv, bottom - top, top);
    block.radiance[i] = hits ? value : 0.0F;
  }
}

void look_up(RayBlock& block, const EmitterPlane& emitter, int count) {
  if (emitter.texels_8_bit)
    look_up_texels<true>(block, emitter, count);
  else
    look_up_texels<false>(block, emitter, count);
}

void apply_transmittance(RayBlock& block, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float weighted = block.radiance[i] * (block.above[i] / (block.below[i] * block.below[i]));
    block.radiance[i] = block.radiance[i] > 0.0F ? weighted : 0.0F;
  }
}

void count_reached(const std::uint32_t* words, const std::uint32_t* thresholds, int levels, std::uint32_t* counts,
                   int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) counts[i] = 0;
  for (int level = 0; level < levels; ++level) {
    const std::uint32_t threshold = thresholds[level];
    RELIGN_LOOP
    for (int i = 0; i < count; ++i) counts[i] += words[i] >= threshold ? 1U : 0U;
  }
}

void play_roulette(RayBlock& block, float bound, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const bool survives = unit(block.roulette[i]) * bound * (block.below[i] * block.below[i]) < block.above[i];
    block.radiance[i] = survives ? block.radiance[i] : 0.0F;
  }
}

void equal_runs(std::uint32_t* owner, std::uint32_t* sample, std::uint32_t first, int length, int count) {
  // Half a step above the integer, so that rounding never crosses the next one.
  const double runs = 1.0 / length;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const std::int32_t ray = static_cast<std::int32_t>(first) + i;
    const auto run = static_cast<std::int32_t>((static_cast<double>(ray) + 0.5) * runs);
    owner[i] = static_cast<std::uint32_t>(run);
    sample[i] = static_cast<std::uint32_t>(ray - run * length);
  }
}

void take_pixels(RayBlock& block, const TileStart& tile, const PixelPlaces& given, const std::uint32_t* owner,
                 std::uint32_t* number, int count) {
  const PixelPlaces places = given;
  const float pitch_x = tile.pixel_pitch_x, pitch_y = tile.pixel_pitch_y;
  const float rows = 1.0F / static_cast<float>(places.columns);
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const auto at = static_cast<std::int32_t>(owner[i]);
    // Half a step above the integer, so that rounding never crosses the next one, for boxes of some hundred pixels.
    const auto row = static_cast<std::int32_t>((static_cast<float>(at) + 0.5F) * rows);
    const std::int32_t column = at - row * places.columns;
    block.pixel_x[i] = (static_cast<float>(column) + places.first_column) * pitch_x;
    block.pixel_y[i] = (static_cast<float>(row) + places.first_row) * pitch_y;
    number[i] =
        places.first_number + static_cast<std::uint32_t>(row) * places.frame_width + static_cast<std::uint32_t>(column);
  }
}

void lattice(RayBlock& block, const std::uint32_t* owner, const std::uint32_t* sample,
             const std::uint32_t* const* shift, const std::uint32_t* step, int count) {
  std::uint32_t* const words[4] = {block.u0, block.u1, block.u2, block.u3};
  for (int k = 0; k < 4; ++k) {
    const std::uint32_t* const from = shift[k];
    std::uint32_t* const word = words[k];
    const std::uint32_t by = step[k];
    RELIGN_LOOP
    for (int i = 0; i < count; ++i) word[i] = from[static_cast<std::int32_t>(owner[i])] + sample[i] * by;
  }
}

// Eight partial sums, added as a tree.
void sum_runs(const RayBlock& block, int length, float* sums, int count) {
  for (int run = 0; run * length < count; ++run) {
    const float* const radiance = block.radiance + run * length;
    float partial[8] = {0, 0, 0, 0, 0, 0, 0, 0};
    for (int i = 0; i < length; i += 8)
      for (int lane = 0; lane < 8; ++lane) partial[lane] += radiance[i + lane];
    sums[run] = ((partial[0] + partial[4]) + (partial[2] + partial[6])) +
                ((partial[1] + partial[5]) + (partial[3] + partial[7]));
  }
}

}  // namespace

#define RELIGN_TEXT_OF(name) #name
#define RELIGN_TEXT(name) RELIGN_TEXT_OF(name)

const BlockKernels& kernels() {
  static constexpr BlockKernels table = {RELIGN_TEXT(RELIGN_KERNEL_ISA),
                                         philox,
                                         start_in_ellipse,
                                         start_in_hemisphere,
                                         trace,
                                         look_up,
                                         apply_transmittance,
                                         count_reached,
                                         play_roulette,
                                         equal_runs,
                                         take_pixels,
                                         lattice,
                                         sum_runs,
                                         &ghost_kernels,
                                         &lane_kernels};
  return table;
}

}  // namespace RELIGN_KERNEL_ISA
}  // namespace relign::optics
