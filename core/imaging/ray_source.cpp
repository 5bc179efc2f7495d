#include "imaging/ray_source.h"

#include <algorithm>
#include <cstring>

namespace relign::imaging {
namespace {

using optics::kBlockRays;

// Random streams of one frame seed; they separate the draws that a pixel makes.
enum Stream : std::uint32_t { kCounts = 0, kDirections = 1, kLattice = 2 };

constexpr double kPi = 3.14159265358979323846;

std::uint32_t low(std::uint64_t seed) { return static_cast<std::uint32_t>(seed); }
std::uint32_t high(std::uint64_t seed) { return static_cast<std::uint32_t>(seed >> 32); }

int padded(int count) { return (count + 15) / 16 * 16; }

}  // namespace

RaySource::RaySource() { std::memset(&block_, 0, sizeof block_); }

void RaySource::start_tile(const SceneFile& scene, const optics::BackwardPath& path, const Tile& tile, float* sums) {
  scene_ = &scene;
  tile_ = &tile;
  sums_ = sums;
  start_ = tile.start;
  whole_ = tile.whole_disc;
  count_ = 0;
  std::fill_n(sums, tile.columns * tile.rows, 0.0F);
  if (tile.blind) set_places(start_, scene, tile, path);  // not fitted; the hemisphere sampler needs no region
  int pixel = 0;
  for (int row = 0; row < tile.rows; ++row)
    for (int column = 0; column < tile.columns; ++column, ++pixel) {
      corner_x_[pixel] = (static_cast<float>(column) - 0.5F * static_cast<float>(tile.columns)) * start_.pixel_pitch_x;
      corner_y_[pixel] = (static_cast<float>(row) - 0.5F * static_cast<float>(tile.rows)) * start_.pixel_pitch_y;
      in_frame_[pixel] = static_cast<std::uint32_t>((tile.row + row) * scene.sensor.pixels + tile.column + column);
    }
}

// A ray of the tile's pixel number `pixel`.
void RaySource::add_ray(int pixel, std::uint32_t sample) {
  block_.pixel_x[count_] = corner_x_[pixel];
  block_.pixel_y[count_] = corner_y_[pixel];
  pixel_[count_] = in_frame_[pixel];
  sample_[count_] = sample;
  owner_[count_] = static_cast<std::uint16_t>(pixel);
  ++count_;
}

void RaySource::trace_and_add(const RayPath& way, bool dice, double survival) {
  const optics::BlockKernels& kernels = optics::block_kernels();
  const int count = padded(count_);
  if (whole_)
    kernels.start_in_hemisphere(block_, start_, count);
  else
    kernels.start_in_ellipse(block_, start_, count);
  kernels.trace(block_, way.ops, way.op_count, way.fresnel, count);
  kernels.look_up(block_, *way.emitter, count);
  if (dice)
    kernels.play_dice(block_, static_cast<float>(survival), count);
  else if (way.fresnel)
    kernels.apply_transmittance(block_, count);
  for (int i = 0; i < count_; ++i) sums_[owner_[i]] += block_.radiance[i];
  count_ = 0;
}

void RaySource::flush_random(const RayPath& way, std::uint64_t seed, bool dice, double survival) {
  if (count_ == 0) return;
  optics::block_kernels().philox(block_, pixel_, sample_, kDirections, low(seed), high(seed), padded(count_));
  trace_and_add(way, dice, survival);
}

void RaySource::all_directions(const RayPath& way, std::uint64_t seed, int samples, double survival) {
  whole_ = true;
  const int pixels = tile_->columns * tile_->rows;
  for (int pixel = 0; pixel < pixels; ++pixel)
    for (int sample = 0; sample < samples; ++sample) {
      add_ray(pixel, static_cast<std::uint32_t>(sample));
      if (count_ == kBlockRays) flush_random(way, seed, true, survival);
    }
  flush_random(way, seed, true, survival);
}

void RaySource::binomial_directions(const RayPath& way, std::uint64_t seed, int samples, double survival) {
  const int pixels = tile_->columns * tile_->rows;
  // Distribution function of Binomial(samples, p) in units of 2^-32, by the recurrence of its terms.
  const double p = tile_->area / kPi;
  std::uint32_t thresholds[kMostSamples];
  int levels = 0;
  {
    double term = 1;  // (1 - p)^samples by squaring
    double base = 1 - p;
    for (int n = samples; n > 0; n >>= 1) {
      if (n & 1) term *= base;
      base *= base;
    }
    double sum = 0;
    for (int k = 0; k < samples; ++k) {
      sum += term;
      const double scaled = sum * 4294967296.0;
      if (scaled >= 4294967295.0) break;
      thresholds[levels++] = static_cast<std::uint32_t>(scaled);
      term *= (samples - k) * p / ((k + 1) * (1 - p));
    }
    if (p >= 1) levels = 0;
  }
  // Count of each pixel: how many thresholds its random word reaches.
  const optics::BlockKernels& kernels = optics::block_kernels();
  for (int from = 0; from < pixels; from += kBlockRays) {
    const int count = std::min(kBlockRays, pixels - from);
    for (int i = 0; i < padded(count); ++i) {
      pixel_[i] = in_frame_[std::min(from + i, pixels - 1)];
      sample_[i] = 0;
    }
    kernels.philox(block_, pixel_, sample_, kCounts, low(seed), high(seed), padded(count));
    if (p < 1)
      kernels.count_reached(block_.u0, thresholds, levels, drawn_ + from, padded(count));
    else
      std::fill_n(drawn_ + from, count, static_cast<std::uint32_t>(samples));
  }
  for (int pixel = 0; pixel < pixels; ++pixel)
    for (std::uint32_t k = 0; k < drawn_[pixel]; ++k) {
      add_ray(pixel, k);
      if (count_ == kBlockRays) flush_random(way, seed, true, survival);
    }
  flush_random(way, seed, true, survival);
}

void RaySource::random_directions(const RayPath& way, std::uint64_t seed, int samples) {
  const int pixels = tile_->columns * tile_->rows;
  for (int pixel = 0; pixel < pixels; ++pixel)
    for (int sample = 0; sample < samples; ++sample) {
      add_ray(pixel, static_cast<std::uint32_t>(sample));
      if (count_ == kBlockRays) flush_random(way, seed, false, 1);
    }
  flush_random(way, seed, false, 1);
}

void RaySource::lattice_directions(const RayPath& way, std::uint64_t seed, std::uint32_t group, int samples) {
  // Kronecker sequence of the generalised golden ratio in four dimensions, as 32-bit fractions:
  // powers of 1 / 1.16730397826141868..., the root of x^5 = x + 1.
  constexpr std::uint32_t kStep[4] = {3679390609U, 3152041523U, 2700274805U, 2313257605U};
  const int pixels = tile_->columns * tile_->rows;
  for (int from = 0; from < pixels; from += kBlockRays) {
    // Random shifts of up to one block of pixels.
    const int shifted = std::min(kBlockRays, pixels - from);
    std::uint32_t shift[4][kBlockRays];
    for (int i = 0; i < padded(shifted); ++i) {
      pixel_[i] = in_frame_[std::min(from + i, pixels - 1)];
      sample_[i] = group;
    }
    optics::block_kernels().philox(block_, pixel_, sample_, kLattice, low(seed), high(seed), padded(shifted));
    std::memcpy(shift[0], block_.u0, sizeof block_.u0);
    std::memcpy(shift[1], block_.u1, sizeof block_.u1);
    std::memcpy(shift[2], block_.u2, sizeof block_.u2);
    std::memcpy(shift[3], block_.u3, sizeof block_.u3);
    for (int i = 0; i < shifted; ++i)
      for (int sample = 0; sample < samples; ++sample) {
        const auto step = static_cast<std::uint32_t>(sample);
        block_.u0[count_] = shift[0][i] + step * kStep[0];
        block_.u1[count_] = shift[1][i] + step * kStep[1];
        block_.u2[count_] = shift[2][i] + step * kStep[2];
        block_.u3[count_] = shift[3][i] + step * kStep[3];
        add_ray(from + i, step);
        if (count_ == kBlockRays) trace_and_add(way, false, 1);
      }
    if (count_ > 0) trace_and_add(way, false, 1);
  }
}

}  // namespace relign::imaging
