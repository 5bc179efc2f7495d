// Electronics and imaging errors of captures on a GPU: what a block of threads does to one image. Order and arithmetic
// are those of imaging/read_out.h and imaging/capture_errors.h, so that images have the CPU's bits.
// A Block is explained in optics/one_thread.h.
#pragma once

#include "imaging/pixel_steps.h"

namespace relign::gpu {

// The imaging errors of one capture; where its lists begin in those of all.
struct ErrorJob {
  imaging::ErrorLevels levels;
  imaging::StrayLevels stray_light;
  std::int32_t first_weight, reach;  // of the blur: neighbours on either side; 0: no blur
  std::int32_t rows;                 // index of an image for its rows
  std::int32_t first_node;           // of stray light; -1: none
  std::int32_t first_ring, rings;
  std::int32_t first_hot_pixel, hot_pixels;
};

// Of all captures of a batch, in the memory of the processor that runs the kernels.
struct ErrorBatch {
  const ErrorJob* jobs;
  const float* values;  // weights of blurs, nodes of stray light
  const imaging::Ring* rings;
  const std::uint32_t* hot_pixels;
  float* rows;  // images, blurred along rows
  std::int32_t width, height;
  imaging::ReadOut electronics;
};

// Both compilers must see the same layout.
static_assert(sizeof(ErrorJob) == 120 && sizeof(ErrorBatch) == 96);

RELIGN_DEVICE float smooth_light(const ErrorBatch& batch, const ErrorJob& job, std::int32_t row, std::int32_t column) {
  return imaging::smooth_light(batch.values + job.first_node, imaging::place_in_grid(column, batch.width),
                               imaging::place_in_grid(row, batch.height));
}

RELIGN_DEVICE float light_of_rings(const ErrorBatch& batch, const ErrorJob& job, std::int32_t row,
                                   std::int32_t column) {
  float light = 0.0F;
  for (std::int32_t k = 0; k < job.rings; ++k) {
    const imaging::Ring& ring = batch.rings[job.first_ring + k];
    const double y = imaging::ring_y(ring, row);
    if (y <= ring.reach && y >= -ring.reach) light += imaging::ring_light(ring, static_cast<float>(y), column);
  }
  return light;
}

template <class Block>
RELIGN_DEVICE imaging::StrayFactors stray_factors(const Block& block, const ErrorBatch& batch, const ErrorJob& job) {
  const std::int32_t pixels = batch.width * batch.height;
  double sums[2] = {0, 0};
  block.sum(pixels, sums, [&](std::int32_t i, double& smooth, double& rings) {
    const std::int32_t row = i / batch.width, column = i - row * batch.width;
    smooth = static_cast<double>(smooth_light(batch, job, row, column));
    rings = static_cast<double>(light_of_rings(batch, job, row, column));
  });
  return imaging::stray_factors(job.stray_light, sums[0], sums[1], static_cast<double>(pixels));
}

// at(k): the value k pixels further along the line.
template <class At>
RELIGN_DEVICE float blurred(const float* weights, std::int32_t reach, const At& at) {
  float value = weights[0] * at(0);
  for (std::int32_t k = 1; k <= reach; ++k) value += weights[k] * (at(-k) + at(k));
  return value;
}

RELIGN_DEVICE std::int32_t inside(std::int32_t index, std::int32_t count) {
  return index < 0 ? 0 : index < count ? index : count - 1;
}

// Photon noise, gains, offsets, read noise, quantisation.
RELIGN_DEVICE float with_pixel_errors(const imaging::ErrorLevels& levels, std::uint32_t pixel, float value) {
  if (levels.photon > 0) {
    const imaging::PixelWords words = imaging::pixel_words(imaging::kPhotons, levels.frame_seed, pixel);
    const float mean = imaging::photon_mean(value, 1 / levels.photon);
    const float count = mean > imaging::kFewPhotons
                            ? imaging::many_photons(mean, imaging::photon_bytes(words.of[1], words.of[2], words.of[3]))
                            : imaging::few_photons(mean, words.of[0]);
    value = imaging::light_of_photons(value, levels.photon, count);
  }
  imaging::PixelWords pattern = {{0, 0, 0, 0}};
  if (levels.pixel_gain > 0 || levels.pixel_offset > 0)
    pattern = imaging::pixel_words(imaging::kPatterns, levels.pattern_seed, pixel);
  float gain = levels.gain;
  if (levels.pixel_gain > 0)
    gain *= 1 + levels.pixel_gain *
                    imaging::normal_of<8>(imaging::sum_of_bytes(pattern.of[0]) + imaging::sum_of_bytes(pattern.of[1]));
  value *= gain;
  if (levels.gamma != 1.0F) value = imaging::curved(value, levels.gamma, levels.white, 1 / levels.white);
  if (levels.pixel_offset > 0)
    value += levels.pixel_offset *
             imaging::normal_of<8>(imaging::sum_of_bytes(pattern.of[2]) + imaging::sum_of_bytes(pattern.of[3]));
  if (levels.offset != 0.0F) value += levels.offset;
  if (levels.read_noise > 0)
    value += levels.read_noise * imaging::normal_of<16>(imaging::sum_of_bytes(
                                     imaging::pixel_words(imaging::kReadNoise, levels.frame_seed, pixel)));
  if (!(levels.full_scale > 0)) return value;
  value = imaging::limited(value, levels.full_scale);
  return levels.steps > 0 ? imaging::rounded(value, levels.steps / levels.full_scale, levels.full_scale / levels.steps)
                          : value;
}

// Of the frame's seed.
RELIGN_DEVICE void apply_electronics(const ErrorBatch& batch, std::uint64_t seed, std::int32_t pixel, float* image) {
  const auto number = static_cast<std::uint32_t>(pixel);
  const imaging::PixelWords words = imaging::pixel_words(imaging::kElectronics, seed, number);
  image[pixel] = imaging::read_out_pixel(batch.electronics, image[pixel], imaging::sum_of_bytes(words));
}

template <class Block>
RELIGN_DEVICE void apply_errors(const Block& block, const ErrorBatch& batch, const ErrorJob& job, float* image) {
  const imaging::ErrorLevels& levels = job.levels;
  const std::int32_t width = batch.width, height = batch.height, pixels = width * height;
  const bool strays = job.first_node >= 0;
  const imaging::Vignetting& vignetting = levels.vignetting;
  if (strays || vignetting.loss > 0) {
    imaging::StrayFactors factors = {0, 0};
    if (strays) factors = stray_factors(block, batch, job);
    block.for_each(pixels, [&](std::int32_t i) {
      const std::int32_t row = i / width, column = i - row * width;
      float value = image[i];
      if (vignetting.loss > 0)
        value *= imaging::kept_light(vignetting.loss, vignetting.left + static_cast<float>(column),
                                     imaging::vignetting_y(vignetting, row));
      if (strays)
        value += levels.white * imaging::stray_light(factors, smooth_light(batch, job, row, column),
                                                     light_of_rings(batch, job, row, column));
      image[i] = value;
    });
  }
  // Rows, then columns; the border is repeated.
  const float* const weights = batch.values + job.first_weight;
  float* const rows = batch.rows + static_cast<std::uint64_t>(job.rows) * static_cast<std::uint64_t>(pixels);
  if (job.reach > 0)
    block.for_each(pixels, [&](std::int32_t i) {
      const std::int32_t row = i / width, column = i - row * width;
      rows[i] =
          blurred(weights, job.reach, [&](std::int32_t k) { return image[row * width + inside(column + k, width)]; });
    });
  block.for_each(pixels, [&](std::int32_t i) {
    float value = image[i];
    if (job.reach > 0) {
      const std::int32_t row = i / width, column = i - row * width;
      value =
          blurred(weights, job.reach, [&](std::int32_t k) { return rows[inside(row + k, height) * width + column]; });
    }
    image[i] = with_pixel_errors(levels, static_cast<std::uint32_t>(i), value);
  });
  // A pixel may be drawn twice.
  block.for_each(job.hot_pixels,
                 [&](std::int32_t k) { image[batch.hot_pixels[job.first_hot_pixel + k]] = levels.full_scale; });
}

}  // namespace relign::gpu
