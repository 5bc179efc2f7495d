#include "imaging/pixel_loops.h"

#include <algorithm>

#include "imaging/pixel_steps.h"

namespace relign::imaging {
namespace {

#define RELIGN_LOOP _Pragma("omp simd")

// Counts of the pixels with means up to kFewPhotons.
void invert_poisson(const float* mean, const std::uint32_t* words, float* counts, float largest, int count) {
  float probability[optics::kBlockRays], below[optics::kBlockRays], word[optics::kBlockRays];
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) {
    const PoissonSum none = no_photons(mean[i]);
    counts[i] = 0;
    probability[i] = none.probability;
    below[i] = none.below;
    word[i] = poisson_word(words[i]);
  }
  const int steps = photon_steps(largest);
  for (int k = 1; k <= steps; ++k) {
    const float per_k = 1 / static_cast<float>(k);
    RELIGN_LOOP
    for (int i = 0; i < count; ++i) {
      counts[i] += word[i] >= below[i] ? 1.0F : 0.0F;
      PoissonSum sum = {probability[i], below[i]};
      add_count(sum, mean[i], per_k);
      probability[i] = sum.probability;
      below[i] = sum.below;
    }
  }
}

}  // namespace

void apply_vignetting(float* values, int count, float loss, float x, float dy) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) values[i] *= kept_light(loss, x + static_cast<float>(i), dy);
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
  const float per_white = 1 / white;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) values[i] = curved(values[i], gamma, white, per_white);
}

void add_offset(float* values, float offset, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) values[i] += offset;
}

void quantise(float* values, float full_scale, float steps, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) values[i] = limited(values[i], full_scale);
  if (!(steps > 0)) return;
  const float per_step = steps / full_scale, step = full_scale / steps;
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) values[i] = rounded(values[i], per_step, step);
}

void draw_photons(float* values, float quantum, const optics::RayBlock& words, int count) {
  const float per_quantum = 1 / quantum;
  float mean[optics::kBlockRays], counts[optics::kBlockRays];
  float largest = 0, largest_exact = 0;
  for (int i = 0; i < count; ++i) {
    mean[i] = photon_mean(values[i], per_quantum);
    largest = std::max(largest, mean[i]);
    largest_exact = std::max(largest_exact, mean[i] > kFewPhotons ? 0.0F : mean[i]);
  }
  invert_poisson(mean, words.u0, counts, largest_exact, count);
  if (largest > kFewPhotons) {
    RELIGN_LOOP
    for (int i = 0; i < count; ++i) {
      const float many = many_photons(mean[i], photon_bytes(words.u1[i], words.u2[i], words.u3[i]));
      counts[i] = mean[i] > kFewPhotons ? many : counts[i];
    }
  }
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) values[i] = light_of_photons(values[i], quantum, counts[i]);
}

void normals_of_8_bytes(float* values, const std::uint32_t* a, const std::uint32_t* b, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i) values[i] = normal_of<8>(sum_of_bytes(a[i]) + sum_of_bytes(b[i]));
}

void add_normal(float* values, float sigma, const optics::RayBlock& words, int count) {
  RELIGN_LOOP
  for (int i = 0; i < count; ++i)
    values[i] += sigma * normal_of<16>(sum_of_bytes(words.u0[i]) + sum_of_bytes(words.u1[i]) +
                                       sum_of_bytes(words.u2[i]) + sum_of_bytes(words.u3[i]));
}

}  // namespace relign::imaging
