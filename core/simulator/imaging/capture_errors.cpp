#include "imaging/capture_errors.h"

#include <algorithm>
#include <cmath>

#include "imaging/error_math.h"
#include "optics/elementary.h"

namespace relign::imaging {
namespace {

using optics::kBlockRays;

// Streams of the seeds of station and frame. Upper half: apart from those of rays and of paths (path_random.h).
constexpr std::uint64_t kTag = 0x65727273ULL << 32;
// Of the errors' own seed, which draw() derives from that of the frame.
enum Stream : std::uint32_t { kPatterns, kPhotons, kReadNoise };
constexpr std::uint64_t kStationValues = kTag, kFrameValues = kTag + 1, kHotPixels = kTag + 2;

// Sum of the bytes of a word.
inline std::uint32_t byte_sum(std::uint32_t word) {
  const std::uint32_t pairs = (word & 0x00ff00ffU) + (word >> 8 & 0x00ff00ffU);
  return (pairs & 0xffffU) + (pairs >> 16);
}

// A sum of `bytes` uniform bytes, scaled to mean 0 and variance 1: nearly normal, with tails that end at
// sqrt(3 bytes).
struct ByteNormal {
  explicit ByteNormal(int bytes)
      : mean(127.5F * static_cast<float>(bytes)), unit(1 / std::sqrt(65535.0F / 12 * static_cast<float>(bytes))) {}
  float of(std::uint32_t sum) const { return (static_cast<float>(static_cast<std::int32_t>(sum)) - mean) * unit; }
  float mean, unit;
};

// The discrete Gaussian exp(-t) I_n(t), t = sigma^2: its variance is exactly sigma^2, which that of a sampled Gaussian
// below one pixel is not (Lindeberg, IEEE Trans. PAMI 12, 1990). Up to the last weight above 1e-5.
std::vector<double> gaussian_weights(double sigma) {
  constexpr double kLeast = 1e-5;
  const double half = sigma * sigma / 2;
  std::vector<double> weights;
  double leading = 1, sum = 0;  // half^n / n!
  for (int n = 0; n == 0 || weights.back() > kLeast * sum; ++n) {
    if (n > 0) leading *= half / n;
    double term = leading, bessel = 0;
    for (int k = 1; term > 1e-17 * bessel; ++k) {
      bessel += term;
      term *= half * half / (static_cast<double>(k) * (k + n));
    }
    weights.push_back(bessel);
    sum += n == 0 ? bessel : 2 * bessel;
  }
  if (weights.size() > 1) {
    sum -= 2 * weights.back();
    weights.pop_back();
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

}  // namespace

CaptureErrors::CaptureErrors(const ImagingErrors& errors, const Sensor& sensor, double white, double target_side_mm)
    : errors_(errors),
      width_(sensor.width),
      height_(sensor.height),
      file_pixel_(sensor.file_pitch_mm / sensor.pitch_mm),
      white_(static_cast<float>(white)),
      target_side_mm_(target_side_mm) {
  if (errors.stray_light) stray_light_.emplace(width_, height_);
  if (errors.pixel_gain.high > 0) pixel_gain_.resize(sensor.pixels());
  if (errors.pixel_offset.high > 0) pixel_offset_.resize(sensor.pixels());
  const auto reach = 2 * gaussian_weights(errors.blur_px.high * file_pixel_).size();
  weights_.reserve(reach);
  if (errors.blur_px.high > 0) {
    rows_.resize(sensor.pixels());
    padded_.resize(static_cast<std::size_t>(width_) + reach);
  }
}

bool CaptureErrors::draw(std::uint64_t frame_seed) {
  Random random(frame_seed, kFrameValues);
  if (random.uniform() >= errors_.share) return false;
  frame_seed_ = random.bits64();
  if (errors_.each_capture)
    draw_station(frame_seed_);
  else if (!drawn_)
    draw_station(errors_.seed);
  drawn_ = true;
  return true;
}

void CaptureErrors::draw_station(std::uint64_t seed) {
  station_seed_ = seed;
  Random random(seed, kStationValues);
  const auto drawn = [&](const Range& range) { return static_cast<float>(range.draw(random)); };
  levels_ = {};
  levels_.vignetting = drawn(errors_.vignetting);
  levels_.centre_x = drawn({-0.1, 0.1});
  levels_.centre_y = drawn({-0.1, 0.1});
  set_blur(errors_.blur_px.draw(random) * file_pixel_);
  levels_.photon = white_ * drawn(errors_.photon);
  levels_.pixel_gain = drawn(errors_.pixel_gain);
  levels_.gain = drawn(errors_.gain);
  levels_.gamma = drawn(errors_.gamma);
  levels_.pixel_offset = white_ * drawn(errors_.pixel_offset);
  levels_.offset = white_ * drawn(errors_.offset);
  levels_.read_noise = white_ * drawn(errors_.read_noise);
  levels_.hot_pixels = drawn(errors_.hot_pixels);
  levels_.full_scale = white_ * drawn(errors_.full_scale.value_or(Range{}));
  const int bits = errors_.bits.draw_integer(random);
  levels_.steps = bits > 0 ? static_cast<float>((1 << bits) - 1) : 0;
  if (errors_.target) {
    const double scale = errors_.target->scale.draw(random);
    const double x = errors_.target->shift.draw(random) * target_side_mm_;
    const double y = errors_.target->shift.draw(random) * target_side_mm_;
    optics::Motion print;  // world = scale * turn(print) + shift
    print.rotation = optics::rotation_of_degrees(0, 0, errors_.target->rotation_deg.draw(random));
    print.translation = {x, y, 0};
    into_print_ = optics::inverse(print);
    for (std::size_t i : {0U, 1U, 3U, 4U}) into_print_->rotation[i] /= scale;
    into_print_->translation = {into_print_->translation.x / scale, into_print_->translation.y / scale, 0};
  }
  if (stray_light_) stray_light_->draw(*errors_.stray_light, random);
  draw_patterns();
}

void CaptureErrors::set_blur(double sigma_px) {
  weights_.clear();
  for (const double weight : gaussian_weights(sigma_px)) weights_.push_back(static_cast<float>(weight));
}

void CaptureErrors::draw_words(std::uint32_t stream, std::uint64_t seed, int first, int count) {
  std::uint32_t number[kBlockRays], zero[kBlockRays] = {};
  for (int i = 0; i < kBlockRays; ++i) number[i] = static_cast<std::uint32_t>(first + i);
  // The seed is a drawn one, so that any stream of it is free.
  optics::block_kernels().philox(words_, number, zero, stream, static_cast<std::uint32_t>(seed),
                                 static_cast<std::uint32_t>(seed >> 32), (count + 15) / 16 * 16);
}

void CaptureErrors::draw_patterns() {
  if (pixel_gain_.empty() && pixel_offset_.empty()) return;
  const ByteNormal normal(8);
  for (int first = 0; first < width_ * height_; first += kBlockRays) {
    const int count = std::min(kBlockRays, width_ * height_ - first);
    draw_words(kPatterns, Random(station_seed_, kHotPixels + 1).bits64(), first, count);
    if (!pixel_gain_.empty())
      for (int i = 0; i < count; ++i)
        pixel_gain_[static_cast<std::size_t>(first + i)] = normal.of(byte_sum(words_.u0[i]) + byte_sum(words_.u1[i]));
    if (!pixel_offset_.empty())
      for (int i = 0; i < count; ++i)
        pixel_offset_[static_cast<std::size_t>(first + i)] = normal.of(byte_sum(words_.u2[i]) + byte_sum(words_.u3[i]));
  }
}

void CaptureErrors::apply(float* pixels) {
  add_light(pixels);
  if (weights_.size() > 1) blur(pixels);
  for (int first = 0; first < width_ * height_; first += kBlockRays) {
    const int count = std::min(kBlockRays, width_ * height_ - first);
    if (levels_.photon > 0) add_photon_noise(pixels + first, first, count);
    read_out(pixels + first, first, count);
  }
  if (levels_.hot_pixels > 0) light_hot_pixels(pixels);
}

void CaptureErrors::add_light(float* pixels) const {
  const float longer = static_cast<float>(std::max(width_, height_));
  const float corner2 =
      static_cast<float>(0.25 * (static_cast<double>(width_) * width_ + static_cast<double>(height_) * height_));
  const float loss = levels_.vignetting / corner2;
  const float left = 0.5F * static_cast<float>(1 - width_) - levels_.centre_x * longer;
  for (int row = 0; row < height_; ++row) {
    float* const out = pixels + static_cast<std::ptrdiff_t>(row) * width_;
    if (loss > 0) {
      const float dy = static_cast<float>(row) + 0.5F * static_cast<float>(1 - height_) - levels_.centre_y * longer;
      for (int column = 0; column < width_; ++column) {
        const float dx = left + static_cast<float>(column);
        const float kept = 1 - loss * (dx * dx + dy * dy);
        out[column] *= kept < 0 ? 0.0F : kept;
      }
    }
    if (!stray_light_) continue;
    const float* const light = stray_light_->field().data() + static_cast<std::ptrdiff_t>(row) * width_;
    for (int column = 0; column < width_; ++column) out[column] += white_ * light[column];
  }
}

// Rows, then columns; the border is repeated.
void CaptureErrors::blur(float* pixels) {
  const int reach = static_cast<int>(weights_.size()) - 1;
  for (int row = 0; row < height_; ++row) {
    const float* const in = pixels + static_cast<std::ptrdiff_t>(row) * width_;
    float* const out = rows_.data() + static_cast<std::ptrdiff_t>(row) * width_;
    float* const middle = padded_.data() + reach;
    std::copy_n(in, width_, middle);
    std::fill_n(padded_.data(), reach, in[0]);
    std::fill_n(middle + width_, reach, in[width_ - 1]);
    for (int column = 0; column < width_; ++column) out[column] = weights_[0] * middle[column];
    for (int k = 1; k <= reach; ++k) {
      const float weight = weights_[static_cast<std::size_t>(k)];
      for (int column = 0; column < width_; ++column) out[column] += weight * (middle[column - k] + middle[column + k]);
    }
  }
  const auto line = [&](int row) {
    return rows_.data() + static_cast<std::ptrdiff_t>(std::clamp(row, 0, height_ - 1)) * width_;
  };
  for (int row = 0; row < height_; ++row) {
    float* const out = pixels + static_cast<std::ptrdiff_t>(row) * width_;
    const float* const middle = line(row);
    for (int column = 0; column < width_; ++column) out[column] = weights_[0] * middle[column];
    for (int k = 1; k <= reach; ++k) {
      const float weight = weights_[static_cast<std::size_t>(k)];
      const float* const above = line(row - k);
      const float* const below = line(row + k);
      for (int column = 0; column < width_; ++column) out[column] += weight * (above[column] + below[column]);
    }
  }
}

// A count k of mean m = value / quantum: up to kExact by inversion of the distribution (cut at a probability of 1e-6),
// above from a normal z with the mean, variance and, nearly, skewness of Poisson: m + sqrt(m - 5/36) z + (z^2 - 1) / 6,
// rounded.
void CaptureErrors::add_photon_noise(float* pixels, int first, int count) {
  constexpr float kExact = 12;
  constexpr float kLog2E = 1.44269504F;
  constexpr int kMostCounts = 48;
  draw_words(kPhotons, frame_seed_, first, count);
  const float quantum = levels_.photon, per_quantum = 1 / quantum;
  float mean[kBlockRays], few[kBlockRays], probability[kBlockRays], below[kBlockRays], word[kBlockRays];
  float most = 0, least_of_many = 0;
  for (int i = 0; i < count; ++i) {
    const float value = pixels[i] * per_quantum;
    mean[i] = value < 0 ? 0.0F : value;
    const float small = mean[i] > kExact ? 0.0F : mean[i];
    most = std::max(most, small);
    least_of_many = std::max(least_of_many, mean[i]);
    few[i] = 0;
    probability[i] = below[i] = exp2_of(-kLog2E * small);
    word[i] = static_cast<float>(static_cast<std::int32_t>(words_.u0[i] >> 8)) * (0x1p-24F * 0.999999F);
  }
  const int counts = std::min(kMostCounts, static_cast<int>(most + 5.5F * std::sqrt(most) + 6));
  for (int k = 1; k <= counts; ++k) {
    const float per_k = 1 / static_cast<float>(k);
    for (int i = 0; i < count; ++i) {
      few[i] += word[i] >= below[i] ? 1.0F : 0.0F;
      probability[i] *= mean[i] * per_k;
      below[i] += probability[i];
    }
  }
  const ByteNormal normal(12);
  if (least_of_many > kExact)
    for (int i = 0; i < count; ++i) {
      const float z = normal.of(byte_sum(words_.u1[i]) + byte_sum(words_.u2[i]) + byte_sum(words_.u3[i]));
      const bool many = mean[i] > kExact;
      const float root = std::sqrt(many ? mean[i] - 5.0F / 36 : 0.0F);
      const float drawn = mean[i] + root * z + (z * z - 1) * (1.0F / 6) + 0.5F;
      const auto whole = static_cast<float>(static_cast<std::int32_t>(drawn < 0 ? 0.0F : drawn));
      few[i] = many ? whole : few[i];
    }
  for (int i = 0; i < count; ++i) pixels[i] = pixels[i] > 0 ? quantum * few[i] : pixels[i];
}

void CaptureErrors::read_out(float* pixels, int first, int count) {
  const Levels& level = levels_;
  if (!pixel_gain_.empty()) {
    const float* const pattern = pixel_gain_.data() + first;
    for (int i = 0; i < count; ++i) pixels[i] *= 1 + level.pixel_gain * pattern[i];
  }
  for (int i = 0; i < count; ++i) pixels[i] *= level.gain;
  if (level.gamma != 1.0F) {
    const float per_white = 1 / white_;
    constexpr float kLeast = 1e-30F;
    for (int i = 0; i < count; ++i) {
      const float share = pixels[i] * per_white;
      const float curved = white_ * exp2_of(level.gamma * log2_of(share > kLeast ? share : kLeast));
      pixels[i] = share > kLeast ? curved : pixels[i];
    }
  }
  if (!pixel_offset_.empty()) {
    const float* const pattern = pixel_offset_.data() + first;
    for (int i = 0; i < count; ++i) pixels[i] += level.pixel_offset * pattern[i];
  }
  for (int i = 0; i < count; ++i) pixels[i] += level.offset;
  if (level.read_noise > 0) {
    draw_words(kReadNoise, frame_seed_, first, count);
    const ByteNormal normal(16);
    for (int i = 0; i < count; ++i)
      pixels[i] += level.read_noise * normal.of(byte_sum(words_.u0[i]) + byte_sum(words_.u1[i]) +
                                                byte_sum(words_.u2[i]) + byte_sum(words_.u3[i]));
  }
  if (!errors_.has_full_scale()) return;
  for (int i = 0; i < count; ++i) {
    const float filled = pixels[i] < 0 ? 0.0F : pixels[i];
    pixels[i] = filled > level.full_scale ? level.full_scale : filled;
  }
  if (level.steps == 0) return;
  const float per_step = level.steps / level.full_scale, step = level.full_scale / level.steps;
  for (int i = 0; i < count; ++i)
    pixels[i] = step * static_cast<float>(static_cast<std::int32_t>(pixels[i] * per_step + 0.5F));
}

// At places of the station; the same pixel may be drawn twice.
void CaptureErrors::light_hot_pixels(float* pixels) const {
  Random random(station_seed_, kHotPixels);
  const auto all = static_cast<std::uint64_t>(width_) * static_cast<std::uint64_t>(height_);
  const auto hot =
      static_cast<std::uint64_t>(static_cast<double>(levels_.hot_pixels) * static_cast<double>(all) + random.uniform());
  for (std::uint64_t i = 0; i < hot; ++i) pixels[random.below(all)] = levels_.full_scale;
}

}  // namespace relign::imaging
