// The loops over pixels of imaging errors (pixel_steps.h): plain arrays and scalars, so that they vectorise. Internal
// to imaging; used by capture_errors.cpp.
#pragma once

#include <cstdint>

#include "optics/ray_block.h"

namespace relign::imaging {

// values[i] *= max(0, 1 - loss ((x + i)^2 + dy^2)).
void apply_vignetting(float* values, int count, float loss, float x, float dy);
// values[i] += factor terms[i].
void add_scaled(float* values, const float* terms, float factor, int count);
// out[i] = factor values[i].
void scale_into(float* out, const float* values, float factor, int count);
// out[i] += factor (a[i] + b[i]).
void add_scaled_pair(float* out, const float* a, const float* b, float factor, int count);
// values[i] *= gain (1 + factor pattern[i]); pattern may be null.
void apply_gain(float* values, const float* pattern, float factor, float gain, int count);
// values[i] = white (values[i] / white)^gamma where values[i] > 0.
void apply_gamma(float* values, float gamma, float white, int count);
// values[i] += offset.
void add_offset(float* values, float offset, int count);
// Limits to 0..full_scale and, if steps > 0, rounds to that many steps.
void quantise(float* values, float full_scale, float steps, int count);

// values[i] becomes quantum * k, k Poisson-distributed with mean values[i] / quantum; negative values stay.
void draw_photons(float* values, float quantum, const optics::RayBlock& words, int count);

// Nearly normal values of mean 0 and variance 1.
void normals_of_8_bytes(float* values, const std::uint32_t* a, const std::uint32_t* b, int count);
// values[i] += sigma z, z from 16 bytes.
void add_normal(float* values, float sigma, const optics::RayBlock& words, int count);

}  // namespace relign::imaging
