#include "imaging/capture_errors.h"

#include <algorithm>
#include <cmath>

#include "imaging/pixel_loops.h"
#include "optics/elementary.h"

namespace relign::imaging {
namespace {

using optics::kBlockRays;

// Streams of the seeds of station and frame. Upper half: apart from those of rays and of paths (path_random.h).
constexpr std::uint64_t kTag = 0x65727273ULL << 32;
// Of the errors' own seed, which draw() derives from that of the frame.
enum Stream : std::uint32_t { kPatterns, kPhotons, kReadNoise };
constexpr std::uint64_t kStationValues = kTag, kFrameValues = kTag + 1, kHotPixels = kTag + 2, kPatternSeed = kTag + 3,
                        kWhichErrors = kTag + 4;

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

ImagingErrors CaptureErrors::drawn_errors(std::uint64_t seed) const {
  ImagingErrors errors = errors_;
  Random random(seed, kWhichErrors);
  const ImagingErrors none;
  const auto leave_out = [&](auto ImagingErrors::*error) {
    if (random.uniform() >= errors_.error_share) errors.*error = none.*error;
  };
  leave_out(&ImagingErrors::target);
  leave_out(&ImagingErrors::stray_light);
  for (Range ImagingErrors::*error :
       {&ImagingErrors::vignetting, &ImagingErrors::blur_px, &ImagingErrors::photon, &ImagingErrors::pixel_gain,
        &ImagingErrors::gain, &ImagingErrors::gamma, &ImagingErrors::pixel_offset, &ImagingErrors::offset,
        &ImagingErrors::read_noise, &ImagingErrors::hot_pixels, &ImagingErrors::bits})
    leave_out(error);
  return errors;
}

void CaptureErrors::draw_station(std::uint64_t seed) {
  station_seed_ = seed;
  const ImagingErrors errors = drawn_errors(seed);
  Random random(seed, kStationValues);
  const auto drawn = [&](const Range& range) { return static_cast<float>(range.draw(random)); };
  levels_ = {};
  levels_.vignetting = drawn(errors.vignetting);
  levels_.centre_x = drawn({-0.1, 0.1});
  levels_.centre_y = drawn({-0.1, 0.1});
  set_blur(errors.blur_px.draw(random) * file_pixel_);
  levels_.photon = white_ * drawn(errors.photon);
  levels_.pixel_gain = drawn(errors.pixel_gain);
  levels_.gain = drawn(errors.gain);
  levels_.gamma = drawn(errors.gamma);
  levels_.pixel_offset = white_ * drawn(errors.pixel_offset);
  levels_.offset = white_ * drawn(errors.offset);
  levels_.read_noise = white_ * drawn(errors.read_noise);
  levels_.hot_pixels = drawn(errors.hot_pixels);
  const float full_scale = white_ * drawn(errors.full_scale.value_or(Range{}));
  levels_.full_scale = errors.has_full_scale() ? full_scale : 0;
  const int bits = errors.bits.draw_integer(random);
  levels_.steps = bits > 0 ? static_cast<float>((1 << bits) - 1) : 0;
  into_print_.reset();
  if (errors.target) {
    const double scale = errors.target->scale.draw(random);
    const double x = errors.target->shift.draw(random) * target_side_mm_;
    const double y = errors.target->shift.draw(random) * target_side_mm_;
    optics::Motion print;  // world = scale * turn(print) + shift
    print.rotation = optics::rotation_of_degrees(0, 0, errors.target->rotation_deg.draw(random));
    print.translation = {x, y, 0};
    into_print_ = optics::inverse(print);
    for (std::size_t i : {0U, 1U, 3U, 4U}) into_print_->rotation[i] /= scale;
    into_print_->translation = {into_print_->translation.x / scale, into_print_->translation.y / scale, 0};
  }
  levels_.stray_light = errors.stray_light.has_value();
  if (levels_.stray_light) stray_light_->draw(*errors.stray_light, random);
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
  const std::uint64_t seed = Random(station_seed_, kPatternSeed).bits64();
  for (int first = 0; first < width_ * height_; first += kBlockRays) {
    const int count = std::min(kBlockRays, width_ * height_ - first);
    draw_words(kPatterns, seed, first, count);
    if (!pixel_gain_.empty()) normals_of_8_bytes(pixel_gain_.data() + first, words_.u0, words_.u1, count);
    if (!pixel_offset_.empty()) normals_of_8_bytes(pixel_offset_.data() + first, words_.u2, words_.u3, count);
  }
}

void CaptureErrors::apply(float* pixels) {
  add_light(pixels);
  if (weights_.size() > 1) blur(pixels);
  for (int first = 0; first < width_ * height_; first += kBlockRays) {
    const int count = std::min(kBlockRays, width_ * height_ - first);
    if (levels_.photon > 0) {
      draw_words(kPhotons, frame_seed_, first, count);
      draw_photons(pixels + first, levels_.photon, words_, count);
    }
    read_out(pixels + first, first, count);
  }
  if (levels_.hot_pixels > 0) light_hot_pixels(pixels);
}

void CaptureErrors::add_light(float* pixels) const {
  const float width = static_cast<float>(width_), height = static_cast<float>(height_);
  const float longer = std::max(width, height);
  const float loss = levels_.vignetting / (0.25F * (width * width + height * height));
  for (int row = 0; row < height_; ++row) {
    float* const out = pixels + static_cast<std::ptrdiff_t>(row) * width_;
    if (loss > 0)
      apply_vignetting(out, width_, loss, 0.5F * (1 - width) - levels_.centre_x * longer,
                       static_cast<float>(row) + 0.5F * (1 - height) - levels_.centre_y * longer);
    if (levels_.stray_light)
      add_scaled(out, stray_light_->field().data() + static_cast<std::ptrdiff_t>(row) * width_, white_, width_);
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
    scale_into(out, middle, weights_[0], width_);
    for (int k = 1; k <= reach; ++k)
      add_scaled_pair(out, middle - k, middle + k, weights_[static_cast<std::size_t>(k)], width_);
  }
  const auto line = [&](int row) {
    return rows_.data() + static_cast<std::ptrdiff_t>(std::clamp(row, 0, height_ - 1)) * width_;
  };
  for (int row = 0; row < height_; ++row) {
    float* const out = pixels + static_cast<std::ptrdiff_t>(row) * width_;
    scale_into(out, line(row), weights_[0], width_);
    for (int k = 1; k <= reach; ++k)
      add_scaled_pair(out, line(row - k), line(row + k), weights_[static_cast<std::size_t>(k)], width_);
  }
}

void CaptureErrors::read_out(float* pixels, int first, int count) {
  const auto pattern = [&](const std::vector<float>& all) { return all.empty() ? nullptr : all.data() + first; };
  apply_gain(pixels, pattern(pixel_gain_), levels_.pixel_gain, levels_.gain, count);
  if (levels_.gamma != 1.0F) apply_gamma(pixels, levels_.gamma, white_, count);
  if (const float* const offsets = pattern(pixel_offset_)) add_scaled(pixels, offsets, levels_.pixel_offset, count);
  if (levels_.offset != 0.0F) add_offset(pixels, levels_.offset, count);
  if (levels_.read_noise > 0) {
    draw_words(kReadNoise, frame_seed_, first, count);
    add_normal(pixels, levels_.read_noise, words_, count);
  }
  if (levels_.full_scale > 0) quantise(pixels, levels_.full_scale, levels_.steps, count);
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
