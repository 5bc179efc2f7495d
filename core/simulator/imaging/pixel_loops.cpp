#include "imaging/pixel_loops.h"

#include <algorithm>
#include <cmath>

#include "imaging/error_math.h"

namespace relign::imaging {
namespace {

#define RELIGN_LOOP _Pragma("omp simd")

// Sum of the bytes of a word.
inline std::uint32_t sum_of_bytes(std::uint32_t word) {
  const std::uint32_t pairs = (word & 0x00ff00ffU) + (word >> 8 & 0x00ff00ffU);
  return (pairs & 0xffffU) + (pairs >> 16);
}

// A sum of `bytes` uniform bytes, scaled.
inline float normal_of(std::uint32_t sum, int bytes, float unit) {
  return (static_cast<float>(static_cast<std::int32_t>(2 * sum)) - static_cast<float>(255 * bytes)) * unit;
}
// Half of the inverse standard deviation.
float unit_of(int bytes) { return static_cast<float>(0.5 / std::sqrt(65535.0 / 12 * bytes)); }

constexpr float kExactMean = 12;

// Counts of the pixels with means up to kExactMean.
void invert_poisson(const float* mean, const std::uint32_t* words, float* counts, float largest, int count) {
  constexpr float kLog2E = 1.44269504F;
  constexpr float kNegligible = 1e-20F;
  constexpr int kMostCounts = 48;
  float probability[optics::kBlockRays], below[optics::kBlockRays], word[optics::kBlockRays];
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float small = mean[i] > kExactMean ? 0.0F : mean[i];
    counts[i] = 0;
    probability[i] = below[i] = exp2_of(-kLog2E * small);
    word[i] = static_cast<float>(static_cast<std::int32_t>(words[i] >> 8)) * (0x1p-24F * 0.999999F);
  }
  const int most = std::min(kMostCounts, static_cast<int>(largest + 5.5F * std::sqrt(largest) + 6));
  for (int k = 1; k <= most; ++k) {
    const float per_k = 1 / static_cast<float>(k);
    RELIGN_LOOP
    for (int i = 0; i < count; ++i) {
      counts[i] += word[i] >= below[i] ? 1.0F : 0.0F;
      const float next = probability[i] * (mean[i] * per_k);
      probability[i] = next < kNegligible ? 0.0F : next;  // before it becomes denormal, which is slow
      below[i] += probability[i];
    }
  }
}

}  // namespace

void apply_vignetting(float* values, int count, float loss, float x, float dy) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float dx = x + static_cast<float>(i);
    const float kept = 1 - loss * (dx * dx + dy * dy);
    values[i] *= kept < 0 ? 0.0F : kept;
  }
}

void add_scaled(float* values, const float* terms, float factor, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) values[i] += factor * terms[i];
}

void scale_into(float* out, const float* values, float factor, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) out[i] = factor * values[i];
}

void add_scaled_pair(float* out, const float* a, const float* b, float factor, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) out[i] += factor * (a[i] + b[i]);
}

void apply_gain(float* values, const float* pattern, float factor, float gain, int count) {
  if (!pattern) {
    RELIGN_LOOP
    for (int i = 0; i < count; ++i) values[i] *= gain;
    return;
  }
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) values[i] *= gain * (1 + factor * pattern[i]);
}

void apply_gamma(float* values, float gamma, float white, int count) {
  constexpr float kLeast = 1e-30F;
  const float per_white = 1 / white;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float share = values[i] * per_white;
    const float curved = white * exp2_of(gamma * log2_of(share > kLeast ? share : kLeast));
    values[i] = share > kLeast ? curved : values[i];
  }
}

void add_offset(float* values, float offset, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) values[i] += offset;
}

void quantise(float* values, float full_scale, float steps, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const float filled = values[i] < 0 ? 0.0F : values[i];
    values[i] = filled > full_scale ? full_scale : filled;
  }
  if (!(steps > 0)) return;
  const float per_step = steps / full_scale, step = full_scale / steps;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i)
    values[i] = step * static_cast<float>(static_cast<std::int32_t>(values[i] * per_step + 0.5F));
}

void draw_photons(float* values, float quantum, const optics::RayBlock& words, int count) {
  const float per_quantum = 1 / quantum;
  float mean[optics::kBlockRays], counts[optics::kBlockRays];
  float largest = 0, largest_exact = 0;
  for (int i = 0; i < count; ++i) {
    const float value = values[i] * per_quantum;
    mean[i] = value < 0 ? 0.0F : value;
    largest = std::max(largest, mean[i]);
    largest_exact = std::max(largest_exact, mean[i] > kExactMean ? 0.0F : mean[i]);
  }
  invert_poisson(mean, words.u0, counts, largest_exact, count);
  if (largest > kExactMean) {
    const float unit = unit_of(12);
    RELIGN_LOOP
    for (int i = 0; i < count; ++i) {
      const float z =
          normal_of(sum_of_bytes(words.u1[i]) + sum_of_bytes(words.u2[i]) + sum_of_bytes(words.u3[i]), 12, unit);
      const bool many = mean[i] > kExactMean;
      const float root = __builtin_sqrtf(many ? mean[i] - 5.0F / 36 : 0.0F);
      const float drawn = mean[i] + root * z + (z * z - 1) * (1.0F / 6) + 0.5F;
      const auto whole = static_cast<float>(static_cast<std::int32_t>(drawn < 0 ? 0.0F : drawn));
      counts[i] = many ? whole : counts[i];
    }
  }
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) values[i] = values[i] > 0 ? quantum * counts[i] : values[i];
}

void normals_of_8_bytes(float* values, const std::uint32_t* a, const std::uint32_t* b, int count) {
  const float unit = unit_of(8);
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) values[i] = normal_of(sum_of_bytes(a[i]) + sum_of_bytes(b[i]), 8, unit);
}

void add_normal(float* values, float sigma, const optics::RayBlock& words, int count) {
  const float unit = unit_of(16);
  RELIGN_LOOP
  for (int i = 0; i < count; ++i)
    values[i] += sigma * normal_of(sum_of_bytes(words.u0[i]) + sum_of_bytes(words.u1[i]) + sum_of_bytes(words.u2[i]) +
                                       sum_of_bytes(words.u3[i]),
                                   16, unit);
}

}  // namespace relign::imaging
