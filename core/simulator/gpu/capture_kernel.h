// Captures at the paper's noise, with electronics and imaging errors, and noise-free MSE of many lenses and poses at
// once: what the GPU thread of a pixel does, and the kernels themselves, which exist where NVRTC compiles this header.
// A plain loop over pixels runs the same functions on the CPU (capture_batch.h). Random streams, arithmetic and the
// order of sums are those of imaging/camera.h, so that images have its bits.
#pragma once

#include "gpu/read_out_steps.h"
#include "gpu/tile_kernel.h"
#include "imaging/mse_pixel.h"

namespace relign::gpu {

constexpr int kSquareSums = 4;  // of the squares of an image: pixel i is added to sum i % 4, as in images/score.h
static_assert(kTileThreads % kSquareSums == 0);

// Where the jobs are, in the memory of the processor that runs them.
struct Batch {
  const TileJob* tiles;
  const ImageJob* images;
  const optics::Op* ops;
  const std::uint32_t* thresholds;
  optics::EmitterPlane emitter;
  std::int32_t fresnel;
  std::int32_t image_pixels;
  std::int32_t samples;  // MSE: rays per pixel and group
  const float *reference_first, *reference_second, *reference_mean;
};

// Both compilers must see the same layout.
static_assert(sizeof(Batch) == 112);

// The ray of four random words from a pixel: with a direction from the whole disc, or from the ellipse.
RELIGN_DEVICE optics::FloatRay start_ray(const optics::TileStart& start, std::int32_t whole_disc,
                                         const optics::PixelStart& from, const std::uint32_t (&words)[4]) {
  return whole_disc ? start_in_hemisphere(start, from.x, from.y, words[0], words[1], words[2], words[3])
                    : start_in_ellipse(start, from.x, from.y, words[0], words[1], words[2], words[3]);
}

// How many thresholds from `first` on a random word reaches.
RELIGN_DEVICE std::uint32_t count_reached(const Batch& batch, std::int64_t first, std::int32_t thresholds,
                                          std::uint32_t word) {
  std::uint32_t reached = 0;
  for (std::int32_t k = 0; k < thresholds; ++k) reached += word >= batch.thresholds[first + k] ? 1U : 0U;
  return reached;
}

// Moves a ray to the emitter; the radiance there.
RELIGN_DEVICE float radiance_at(const optics::EmitterPlane& emitter, optics::FloatRay& ray) {
  return emitter.texels_8_bit ? optics::look_up<true>(ray, emitter) : optics::look_up<false>(ray, emitter);
}

// The ray of four random words from a pixel, traced to the emitter; its radiance there.
RELIGN_DEVICE float trace_to_emitter(const Batch& batch, const TileJob& tile, const ImageJob& image,
                                     const optics::PixelStart& from, const std::uint32_t (&words)[4],
                                     optics::FloatRay& ray) {
  ray = start_ray(tile.start, tile.whole_disc, from, words);
  if (batch.fresnel)
    optics::trace_ray<true>(ray, batch.ops + image.first_op, image.ops);
  else
    optics::trace_ray<false>(ray, batch.ops + image.first_op, image.ops);
  return radiance_at(batch.emitter, ray);
}

// Of one of a job's places.
template <class Job>
RELIGN_DEVICE optics::PixelStart start_of(const Job& job, std::int32_t pixel) {
  return pixel_start(job.start, job.places, 1.0F / static_cast<float>(job.places.columns), pixel);
}

RELIGN_DEVICE float* image_at(const Batch& batch, const ImageJob& image, float* images) {
  return images + static_cast<std::uint64_t>(image.place) * static_cast<std::uint64_t>(batch.image_pixels);
}

RELIGN_DEVICE double squared_difference(float a, float b) {
  const double difference = static_cast<double>(a) - static_cast<double>(b);
  return difference * difference;
}

RELIGN_DEVICE double sum_of_squares(const double (&sums)[kSquareSums]) {
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

// Writes a pixel of a capture.
RELIGN_DEVICE void capture_pixel(const Batch& batch, const TileJob& tile, std::int32_t lit_pixel, float* images) {
  const ImageJob& image = batch.images[tile.image];
  const optics::PixelStart from = start_of(tile, lit_pixel);
  std::uint32_t drawn[4] = {0, from.number, imaging::kCounts, 0};
  philox_rounds(drawn, image.seed_low, image.seed_high);
  const std::uint32_t rays = count_reached(batch, tile.first_threshold, tile.thresholds, drawn[0]);
  float sum = 0.0F;
  for (std::uint32_t sample = 0; sample < rays; ++sample) {
    std::uint32_t words[4] = {sample, from.number, imaging::kDirections, 0};
    philox_rounds(words, image.seed_low, image.seed_high);
    const std::uint32_t roulette = optics::fifth_word(words[0], words[1], words[2], words[3]);
    optics::FloatRay ray;
    const float radiance = trace_to_emitter(batch, tile, image, from, words, ray);
    sum += survives(ray, roulette, image.highest_transmittance) ? radiance : 0.0F;
  }
  image_at(batch, image, images)[from.number] = static_cast<float>(tile.scale * static_cast<double>(sum));
}

// Electronics of a pixel of a rendered capture: `index` counts those of all images.
RELIGN_DEVICE void read_out_pixel(const Batch& batch, const ErrorBatch& errors, std::int64_t index, float* images) {
  const ImageJob& image = batch.images[index / batch.image_pixels];
  const auto pixel = static_cast<std::int32_t>(index % batch.image_pixels);
  apply_electronics(errors, std::uint64_t{image.seed_high} << 32 | image.seed_low, pixel,
                    image_at(batch, image, images));
}

// Imaging errors of a capture that was read out.
template <class Block>
RELIGN_DEVICE void read_out_image(const Block& block, const Batch& batch, const ErrorBatch& errors,
                                  const ImageJob& image, float* images) {
  float* const pixels = image_at(batch, image, images);
  if (image.errors >= 0) apply_errors(block, errors, errors.jobs[image.errors], pixels);
}

// Sum of the weighted radiances of a lattice of rays: eight partial sums where their number allows, as in RaySource.
RELIGN_DEVICE float lattice_sum(const Batch& batch, const TileJob& tile, const ImageJob& image,
                                const optics::PixelStart& from, const std::uint32_t (&shift)[4]) {
  const auto radiance_of = [&](std::int32_t sample) {
    std::uint32_t words[4];
    for (int k = 0; k < 4; ++k) words[k] = shift[k] + static_cast<std::uint32_t>(sample) * imaging::kLatticeSteps[k];
    optics::FloatRay ray;
    const float radiance = trace_to_emitter(batch, tile, image, from, words, ray);
    if (!batch.fresnel) return radiance;
    return radiance > 0.0F ? radiance * transmittance(ray) : 0.0F;
  };
  float sum = 0.0F;
  if (batch.samples < 8 || (batch.samples & (batch.samples - 1)) != 0) {
    for (std::int32_t sample = 0; sample < batch.samples; ++sample) sum += radiance_of(sample);
    return sum;
  }
  float partial[8] = {0, 0, 0, 0, 0, 0, 0, 0};
  for (std::int32_t first = 0; first < batch.samples; first += 8)
    for (int lane = 0; lane < 8; ++lane) partial[lane] += radiance_of(first + lane);
  sum +=
      ((partial[0] + partial[4]) + (partial[2] + partial[6])) + ((partial[1] + partial[5]) + (partial[3] + partial[7]));
  return sum;
}

// A pixel's part of the MSE against the reference.
RELIGN_DEVICE imaging::MseSum mse_pixel(const Batch& batch, const TileJob& tile, std::int32_t pixel) {
  const ImageJob& image = batch.images[tile.image];
  const std::int32_t row = pixel / tile.columns, column = pixel - row * tile.columns;
  const std::int32_t lit_row = row - tile.lit_row, lit_column = column - tile.lit_column;
  const std::uint32_t number = tile.first_number + static_cast<std::uint32_t>(row) * tile.places.frame_width +
                               static_cast<std::uint32_t>(column);
  double values[imaging::kMseGroups] = {0, 0, 0, 0};
  if (tile.lit_pixels > 0 && lit_row >= 0 && lit_column >= 0 && lit_column < tile.places.columns &&
      lit_row * tile.places.columns < tile.lit_pixels) {
    const optics::PixelStart from = start_of(tile, lit_row * tile.places.columns + lit_column);
    for (std::uint32_t group = 0; group < imaging::kMseGroups; ++group) {
      std::uint32_t shift[4] = {group, number, imaging::kLattice, 0};
      philox_rounds(shift, image.seed_low, image.seed_high);
      values[group] = tile.scale * static_cast<double>(lattice_sum(batch, tile, image, from, shift));
    }
  }
  return imaging::mse_of_pixel(values, static_cast<double>(batch.reference_first[number]),
                               static_cast<double>(batch.reference_second[number]));
}

#if defined(__CUDACC_RTC__)
// One block for each image.
extern "C" __global__ void relign_clear(const Batch batch, float* images) {
  float* const image = image_at(batch, batch.images[blockIdx.x], images);
  for (auto i = static_cast<std::int32_t>(threadIdx.x); i < batch.image_pixels; i += kTileThreads) image[i] = 0.0F;
}

// One block and one sum for each image: of the squares of its differences from the reference, in the order of
// images/score.h, so that measured RMSE has the CPU's bits.
extern "C" __global__ void relign_squares(const Batch batch, const float* images, double* squares) {
  constexpr std::int32_t kStaged = 16 * kTileThreads;  // squares between two barriers
  __shared__ double square[kStaged];
  __shared__ double sums[kSquareSums];
  const float* const image = image_at(batch, batch.images[blockIdx.x], const_cast<float*>(images));
  const auto thread = static_cast<std::int32_t>(threadIdx.x);
  double sum = 0;
  for (std::int32_t first = 0; first < batch.image_pixels; first += kStaged) {
    const std::int32_t rest = batch.image_pixels - first, count = rest < kStaged ? rest : kStaged;
    for (std::int32_t i = thread; i < count; i += kTileThreads)
      square[i] = squared_difference(image[first + i], batch.reference_mean[first + i]);
    __syncthreads();
    if (thread < kSquareSums)
      for (std::int32_t i = thread; i < count; i += kSquareSums) sum += square[i];
    __syncthreads();
  }
  if (thread < kSquareSums) sums[thread] = sum;
  __syncthreads();
  if (thread == 0) squares[blockIdx.x] = sum_of_squares(sums);
}

// One block for each tile. `images` must be black.
extern "C" __global__ void relign_capture(const Batch batch, float* images) {
  const TileJob& tile = batch.tiles[blockIdx.x];
  const auto pixel = static_cast<std::int32_t>(threadIdx.x);
  if (pixel < tile.lit_pixels) capture_pixel(batch, tile, pixel, images);
}

// One thread for each pixel of all images.
extern "C" __global__ void relign_electronics(const Batch batch, float* images, const ErrorBatch errors,
                                              std::int64_t count) {
  const std::int64_t index = static_cast<std::int64_t>(blockIdx.x) * kTileThreads + threadIdx.x;
  if (index < count) read_out_pixel(batch, errors, index, images);
}

// The threads of a GPU block (optics/one_thread.h).
struct BlockOfThreads {
  template <class Body>
  RELIGN_DEVICE void for_each(std::int32_t count, const Body& body) const {
    for (auto i = static_cast<std::int32_t>(threadIdx.x); i < count; i += kTileThreads) body(i);
    __syncthreads();
  }
  template <class Terms>
  RELIGN_DEVICE void sum(std::int32_t count, double (&sums)[2], const Terms& terms) const {
    __shared__ double term[2][kTileThreads];
    __shared__ double result[2];
    const auto thread = static_cast<std::int32_t>(threadIdx.x);
    double sum = 0;
    for (std::int32_t first = 0; first < count; first += kTileThreads) {
      const std::int32_t rest = count - first, here = rest < kTileThreads ? rest : kTileThreads;
      if (thread < here) terms(first + thread, term[0][thread], term[1][thread]);
      __syncthreads();
      if (thread < 2)
        for (std::int32_t i = 0; i < here; ++i) sum += term[thread][i];
      __syncthreads();
    }
    if (thread < 2) result[thread] = sum;
    __syncthreads();
    sums[0] = result[0];
    sums[1] = result[1];
  }
};

// One block for each image. Errors are not in Batch, since the other kernels would need more registers.
extern "C" __global__ void relign_read_out(const Batch batch, float* images, const ErrorBatch errors) {
  read_out_image(BlockOfThreads(), batch, errors, batch.images[blockIdx.x], images);
}

// One block and one sum for each tile, added in the order of its pixels.
extern "C" __global__ void relign_mse(const Batch batch, imaging::MseSum* sums) {
  __shared__ double product[kTileThreads];
  __shared__ double variance[kTileThreads];
  const TileJob& tile = batch.tiles[blockIdx.x];
  const auto pixel = static_cast<std::int32_t>(threadIdx.x);
  if (pixel < tile.pixels) {
    const imaging::MseSum sum = mse_pixel(batch, tile, pixel);
    product[pixel] = sum.product;
    variance[pixel] = sum.variance;
  }
  __syncthreads();
  if (pixel != 0) return;
  imaging::MseSum sum;
  for (std::int32_t i = 0; i < tile.pixels; ++i) sum += imaging::MseSum{product[i], variance[i]};
  sums[blockIdx.x] = sum;
}
#endif

}  // namespace relign::gpu
