#include "imaging/ray_source.h"

#include <algorithm>
#include <cstring>

#include "imaging/binomial.h"
#include "imaging/streams.h"

namespace relign::imaging {
namespace {

using optics::kBlockRays;
using optics::kPi;

std::uint32_t low(std::uint64_t seed) { return static_cast<std::uint32_t>(seed); }
std::uint32_t high(std::uint64_t seed) { return static_cast<std::uint32_t>(seed >> 32); }

int padded(int count) { return (count + 15) / 16 * 16; }

bool is_power_of_two(int value) { return (value & (value - 1)) == 0; }

}  // namespace

RaySource::RaySource() {
  std::memset(&block_, 0, sizeof block_);
  std::memset(owner_, 0, sizeof owner_);
  std::memset(sample_, 0, sizeof sample_);
}

void RaySource::start_tile(const SceneFile& scene, const optics::BackwardPath& path, const Tile& tile,
                           const PixelBox& lit, float* sums) {
  sums_ = sums;
  start_ = tile.start;
  area_ = tile.area;
  whole_ = tile.whole_disc;
  pixels_ = lit.columns * lit.rows;
  std::fill_n(sums, pixels_, 0.0F);
  // Not fitted; the hemisphere sampler needs no region.
  if (tile.unlit) set_places(start_, scene.sensor, tile.box, path.into_first_frame);
  places_ = places_of(tile.box, lit, scene.sensor.width);
}

void RaySource::take_pixels(int count) {
  optics::block_kernels().take_pixels(block_, start_, places_, owner_, number_, count);
}

void RaySource::draw_words(std::uint64_t seed, std::uint32_t stream, int count) {
  optics::block_kernels().philox(block_, number_, sample_, stream, low(seed), high(seed), count);
}

void RaySource::trace_and_weigh(const RayPath& path, Weight weight, double bound, int count) {
  const optics::BlockKernels& kernels = optics::block_kernels();
  if (whole_)
    kernels.start_in_hemisphere(block_, start_, count);
  else
    kernels.start_in_ellipse(block_, start_, count);
  if (derivatives_) {
    derivatives_->trace(block_, path, weight == Weight::roulette ? bound : 1, count);
  } else {
    if (path.tracer)
      path.tracer->trace(block_, path.fresnel, count);
    else
      kernels.trace(block_, path.ops, path.op_count, path.fresnel, count);
    kernels.look_up(block_, *path.emitter, count);
  }
  if (weight == Weight::roulette)
    kernels.play_roulette(block_, static_cast<float>(bound), count);
  else if (path.fresnel)
    kernels.apply_transmittance(block_, count);
}

void RaySource::one_each(int from, int count) {
  for (int i = 0; i < padded(count); ++i) owner_[i] = static_cast<std::uint32_t>(std::min(from + i, pixels_ - 1));
  take_pixels(padded(count));
}

void RaySource::add_derivatives(int count) {
  if (derivatives_) derivatives_->add(owner_, count);
}

void RaySource::add_by_owner(int count) {
  for (int i = 0; i < count; ++i) sums_[owner_[i]] += block_.radiance[i];
}

template <class Words>
void RaySource::equal_runs(const RayPath& path, int samples, Weight weight, double bound, const Words& words) {
  const optics::BlockKernels& kernels = optics::block_kernels();
  const int rays = pixels_ * samples;
  const bool even = samples >= 8 && is_power_of_two(samples);
  for (int first = 0; first < rays; first += kBlockRays) {
    const int count = std::min(kBlockRays, rays - first);
    const int all = padded(count);
    kernels.equal_runs(owner_, sample_, static_cast<std::uint32_t>(first), samples, count);
    for (int i = count; i < all; ++i) owner_[i] = 0;
    take_pixels(all);
    words(all);
    trace_and_weigh(path, weight, bound, all);
    add_derivatives(count);
    if (!even) {
      add_by_owner(count);
      continue;
    }
    float sums[kBlockRays / 8];
    const int length = std::min(samples, kBlockRays);
    kernels.sum_runs(block_, length, sums, count);
    for (int run = 0; run * length < count; ++run) sums_[owner_[run * length]] += sums[run];
  }
}

void RaySource::all_directions(const RayPath& path, std::uint64_t seed, int samples, double survival) {
  whole_ = true;
  equal_runs(path, samples, Weight::roulette, 1 / survival,
             [&](int count) { draw_words(seed, path.streams + kDirections, count); });
}

void RaySource::random_directions(const RayPath& path, std::uint64_t seed, int samples) {
  equal_runs(path, samples, Weight::transmittance, 1,
             [&](int count) { draw_words(seed, path.streams + kDirections, count); });
}

void RaySource::lattice_directions(const RayPath& path, std::uint64_t seed, std::uint32_t group, int samples) {
  std::fill_n(sample_, kBlockRays, group);
  for (int from = 0; from < pixels_; from += kBlockRays) {
    const int count = std::min(kBlockRays, pixels_ - from);
    one_each(from, count);
    draw_words(seed, path.streams + kLattice, padded(count));
    const std::uint32_t* const words[4] = {block_.u0, block_.u1, block_.u2, block_.u3};
    for (int k = 0; k < 4; ++k) std::copy_n(words[k], count, shift_[k] + from);
  }
  const std::uint32_t* const shift[4] = {shift_[0], shift_[1], shift_[2], shift_[3]};
  equal_runs(path, samples, Weight::transmittance, 1,
             [&](int count) { optics::block_kernels().lattice(block_, owner_, sample_, shift, kLatticeSteps, count); });
}

// Draws the number of rays of each pixel: its random word against the distribution function.
void RaySource::draw_counts(std::uint64_t seed, std::uint32_t streams, int samples, double probability) {
  const optics::BlockKernels& kernels = optics::block_kernels();
  std::uint32_t thresholds[kMaxSamples];
  const int levels = probability < 1 ? binomial_thresholds(samples, probability, thresholds) : 0;
  std::fill_n(sample_, kBlockRays, 0U);
  for (int from = 0; from < pixels_; from += kBlockRays) {
    const int count = std::min(kBlockRays, pixels_ - from);
    one_each(from, count);
    draw_words(seed, streams + kCounts, padded(count));
    kernels.count_reached(block_.u0, thresholds, levels, drawn_ + from, padded(count));
  }
  if (probability >= 1) std::fill_n(drawn_, pixels_, static_cast<std::uint32_t>(samples));
}

void RaySource::binomial_directions(const RayPath& path, std::uint64_t seed, int samples, double survival) {
  const double largest_survival = survival * path.highest_transmittance;
  draw_counts(seed, path.streams, samples, area_ / kPi * largest_survival);
  const auto flush = [&](int count) {
    for (int i = count; i < padded(count); ++i) owner_[i] = 0;
    take_pixels(padded(count));
    draw_words(seed, path.streams + kDirections, padded(count));
    trace_and_weigh(path, Weight::roulette, path.highest_transmittance, padded(count));
    add_derivatives(count);
    add_by_owner(count);
  };
  constexpr std::uint32_t kAtOnce = 8;  // always writes this many entries: no branch to mispredict
  static_assert(kAtOnce <= kSpare);
  int filled = 0;
  for (int pixel = 0; pixel < pixels_; ++pixel)
    for (std::uint32_t done = 0; done < drawn_[pixel]; done += kAtOnce) {
      for (std::uint32_t k = 0; k < kAtOnce; ++k) {
        owner_[filled + static_cast<int>(k)] = static_cast<std::uint32_t>(pixel);
        sample_[filled + static_cast<int>(k)] = done + k;
      }
      filled += static_cast<int>(std::min(kAtOnce, drawn_[pixel] - done));
      if (filled < kBlockRays) continue;
      std::uint32_t rest_owner[kAtOnce], rest_sample[kAtOnce];
      std::copy_n(owner_ + kBlockRays, kAtOnce, rest_owner);
      std::copy_n(sample_ + kBlockRays, kAtOnce, rest_sample);
      flush(kBlockRays);
      std::copy_n(rest_owner, kAtOnce, owner_);
      std::copy_n(rest_sample, kAtOnce, sample_);
      filled -= kBlockRays;
    }
  if (filled > 0) flush(filled);
}

}  // namespace relign::imaging
