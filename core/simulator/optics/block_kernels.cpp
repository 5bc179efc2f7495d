// The float kernels of ray_block.h, compiled once for each instruction set (RELIGN_KERNEL_ISA).
//
// Each operation is a plain loop over arrays around the arithmetic of one ray (ray_steps.h), which is always inlined:
// that is what the compiler vectorises. Only builtins and intrinsics are called otherwise, so that no inline function
// of a library header is emitted here with instructions that other code must not run.
#if defined(__AVX2__)
#include <immintrin.h>
#endif

#include "optics/asphere_steps.h"
#include "optics/ray_block.h"
#include "optics/ray_steps.h"

namespace relign::optics {
namespace RELIGN_KERNEL_ISA {
namespace {

#define RELIGN_LOOP _Pragma("omp simd")

// The ray at place i, and back.
RELIGN_DEVICE FloatRay taken(const RayBlock& block, int i) {
  return {block.x[i],  block.y[i],     block.z[i],     block.lx[i],    block.ly[i],
          block.lz[i], block.above[i], block.below[i], block.margin[i]};
}
RELIGN_DEVICE void put(RayBlock& block, int i, const FloatRay& ray) {
  block.x[i] = ray.x;
  block.y[i] = ray.y;
  block.z[i] = ray.z;
  block.lx[i] = ray.lx;
  block.ly[i] = ray.ly;
  block.lz[i] = ray.lz;
  block.above[i] = ray.above;
  block.below[i] = ray.below;
  block.margin[i] = ray.margin;
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
#endif

void philox(RayBlock& block, const std::uint32_t* pixel, const std::uint32_t* sample, std::uint32_t stream,
            std::uint32_t key0, std::uint32_t key1, int count) {
#if defined(__AVX2__)
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
#else
  for (int i = 0; i < count; ++i) {
    std::uint32_t words[4] = {sample[i], pixel[i], stream, 0};
    philox_rounds(words, key0, key1);
    block.u0[i] = words[0];
    block.u1[i] = words[1];
    block.u2[i] = words[2];
    block.u3[i] = words[3];
  }
#endif
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) block.roulette[i] = fifth_word(block.u0[i], block.u1[i], block.u2[i], block.u3[i]);
}

void start_in_ellipse(RayBlock& block, const TileStart& given, int count) {
  const TileStart tile = given;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i)
    put(block, i,
        optics::start_in_ellipse(tile, block.pixel_x[i], block.pixel_y[i], block.u0[i], block.u1[i], block.u2[i],
                                 block.u3[i]));
}

void start_in_hemisphere(RayBlock& block, const TileStart& given, int count) {
  const TileStart tile = given;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i)
    put(block, i,
        optics::start_in_hemisphere(tile, block.pixel_x[i], block.pixel_y[i], block.u0[i], block.u1[i], block.u2[i],
                                    block.u3[i]));
}

// step(ray, operation) for every ray of the block.
template <class Step>
RELIGN_DEVICE void each_ray(RayBlock& block, const Op& given, int count, const Step& step) {
  const Op op = given;  // a copy, whose members stay in registers
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    FloatRay ray = taken(block, i);
    step(ray, op);
    put(block, i, ray);
  }
}

#include "optics/block_asphere.inc"

template <bool Fresnel>
void apply(RayBlock& block, const Op& op, int count) {
  switch (op.kind) {
    case Op::frame:
      each_ray(block, op, count, [](FloatRay& ray, const Op& one) { apply_frame(ray, one); });
      break;
    case Op::shift:
      each_ray(block, op, count, [](FloatRay& ray, const Op& one) { apply_shift(ray, one); });
      break;
    case Op::face:
      each_ray(block, op, count, [](FloatRay& ray, const Op& one) { intersect_face<Fresnel>(ray, one); });
      break;
    case Op::asphere:
      intersect_asphere<Fresnel>(block, op, count);
      break;
    case Op::stop:
      each_ray(block, op, count, [](FloatRay& ray, const Op& one) { intersect_stop(ray, one); });
      break;
    case Op::bore:
      each_ray(block, op, count, [](FloatRay& ray, const Op& one) { intersect_bore(ray, one); });
      break;
  }
}

void keep_state(const RayBlock& block, float* state, int count) {
  const float* const numbers[kStateNumbers] = {block.x, block.y, block.z, block.lx, block.ly, block.lz};
  for (int k = 0; k < kStateNumbers; ++k) {
    const float* const from = numbers[k];
    float* const to = state + k * kBlockRays;
    RELIGN_LOOP
    for (int i = 0; i < count; ++i) to[i] = from[i];
  }
}

void trace_recorded(RayBlock& block, const Op* ops, int op_count, bool fresnel, int count, float* record) {
  int faces = 0;
  for (int k = 0; k < op_count; ++k) {
    const Op& op = ops[k];
    if (record) keep_state(block, record + k * kStateNumbers * kBlockRays, count);
    if (fresnel && (op.kind == Op::face || op.kind == Op::asphere) && ++faces > kFacesPerProduct) {
      each_ray(block, op, count, [](FloatRay& ray, const Op&) { divide_products(ray); });
      faces = 1;
    }
    if (fresnel)
      apply<true>(block, op, count);
    else
      apply<false>(block, op, count);
  }
  if (record) keep_state(block, record + op_count * kStateNumbers * kBlockRays, count);
}

void trace(RayBlock& block, const Op* ops, int op_count, bool fresnel, int count) {
  trace_recorded(block, ops, op_count, fresnel, count, nullptr);
}

template <bool EightBits>
void look_up_texels(RayBlock& block, const EmitterPlane& given, int count) {
  const EmitterPlane emitter = given;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    FloatRay ray = taken(block, i);
    block.radiance[i] = optics::look_up<EightBits>(ray, emitter);
    put(block, i, ray);
  }
}

void look_up(RayBlock& block, const EmitterPlane& emitter, int count) {
  if (emitter.texels_8_bit)
    look_up_texels<true>(block, emitter, count);
  else
    look_up_texels<false>(block, emitter, count);
}

void aim(RayBlock& block, const double (&rotation)[9], const double (&start)[3], const double (&from)[3],
         const double* to_x, const double* to_y, const double* to_z, int count) {
  const double r[9] = {rotation[0], rotation[1], rotation[2], rotation[3], rotation[4],
                       rotation[5], rotation[6], rotation[7], rotation[8]};
  const double from_x = from[0], from_y = from[1], from_z = from[2];
  const float x = static_cast<float>(start[0]), y = static_cast<float>(start[1]), z = static_cast<float>(start[2]);
  RELIGN_LOOP
  for (int i = 0; i < count; ++i)
    put(block, i, aimed_ray(r, x, y, z, to_x[i] - from_x, to_y[i] - from_y, to_z[i] - from_z));
}

void apply_transmittance(RayBlock& block, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float weighted = block.radiance[i] * transmittance(taken(block, i));
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
  for (int i = 0; i < count; ++i)
    block.radiance[i] = survives(taken(block, i), block.roulette[i], bound) ? block.radiance[i] : 0.0F;
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

void take_pixels(RayBlock& block, const TileStart& given_tile, const PixelPlaces& given, const std::uint32_t* owner,
                 std::uint32_t* number, int count) {
  const TileStart tile = given_tile;
  const PixelPlaces places = given;
  const float rows = 1.0F / static_cast<float>(places.columns);
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const PixelStart start = pixel_start(tile, places, rows, static_cast<std::int32_t>(owner[i]));
    block.pixel_x[i] = start.x;
    block.pixel_y[i] = start.y;
    number[i] = start.number;
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
                                         aim,
                                         trace,
                                         trace_recorded,
                                         look_up,
                                         apply_transmittance,
                                         count_reached,
                                         play_roulette,
                                         equal_runs,
                                         take_pixels,
                                         lattice,
                                         sum_runs,
                                         &adjoint_kernels,
                                         &ghost_kernels,
                                         &lane_kernels};
  return table;
}

}  // namespace RELIGN_KERNEL_ISA
}  // namespace relign::optics
