#include "imaging/capture_errors.h"

#include <algorithm>

#include "imaging/pixel_loops.h"

namespace relign::imaging {

using optics::kBlockRays;

CaptureErrors::CaptureErrors(const ImagingErrors& errors, const Sensor& sensor, double white, double target_side_mm)
    : drawn_(errors, sensor, white, target_side_mm), width_(sensor.width), height_(sensor.height) {
  if (errors.stray_light) stray_light_.emplace(width_, height_);
  if (errors.pixel_gain.high > 0) pixel_gain_.resize(sensor.pixels());
  if (errors.pixel_offset.high > 0) pixel_offset_.resize(sensor.pixels());
  if (errors.blur_px.high > 0) {
    rows_.resize(sensor.pixels());
    padded_.resize(static_cast<std::size_t>(width_) + 2 * drawn_.most_weights());
  }
}

void CaptureErrors::draw_words(std::uint32_t stream, std::uint64_t seed, int first, int count) {
  std::uint32_t number[kBlockRays], zero[kBlockRays] = {};
  for (int i = 0; i < kBlockRays; ++i) number[i] = static_cast<std::uint32_t>(first + i);
  // The seed is a drawn one, so that any stream of it is free.
  optics::block_kernels().philox(words_, number, zero, stream, static_cast<std::uint32_t>(seed),
                                 static_cast<std::uint32_t>(seed >> 32), (count + 15) / 16 * 16);
}

// What all captures of a station share.
void CaptureErrors::render_station() {
  if (rendered_ == drawn_.stations()) return;
  rendered_ = drawn_.stations();
  if (const StrayLight* const light = drawn_.stray_light()) stray_light_->render(*light);
  draw_patterns();
}

void CaptureErrors::draw_patterns() {
  if (pixel_gain_.empty() && pixel_offset_.empty()) return;
  for (int first = 0; first < width_ * height_; first += kBlockRays) {
    const int count = std::min(kBlockRays, width_ * height_ - first);
    draw_words(kPatterns, drawn_.levels().pattern_seed, first, count);
    if (!pixel_gain_.empty()) normals_of_8_bytes(pixel_gain_.data() + first, words_.u0, words_.u1, count);
    if (!pixel_offset_.empty()) normals_of_8_bytes(pixel_offset_.data() + first, words_.u2, words_.u3, count);
  }
}

void CaptureErrors::apply(float* pixels) {
  render_station();
  add_light(pixels);
  if (drawn_.weights().size() > 1) blur(pixels);
  const ErrorLevels& levels = drawn_.levels();
  for (int first = 0; first < width_ * height_; first += kBlockRays) {
    const int count = std::min(kBlockRays, width_ * height_ - first);
    if (levels.photon > 0) {
      draw_words(kPhotons, levels.frame_seed, first, count);
      draw_photons(pixels + first, levels.photon, words_, count);
    }
    read_out(pixels + first, first, count);
  }
  drawn_.for_hot_pixels([&](std::uint64_t pixel) { pixels[pixel] = levels.full_scale; });
}

void CaptureErrors::add_light(float* pixels) const {
  const Vignetting& vignetting = drawn_.levels().vignetting;
  for (int row = 0; row < height_; ++row) {
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(row) * width_;
    float* const out = pixels + first;
    if (vignetting.loss > 0)
      apply_vignetting(out, width_, vignetting.loss, vignetting.left, vignetting_y(vignetting, row));
    if (drawn_.stray_light()) add_scaled(out, stray_light_->pixels().data() + first, drawn_.levels().white, width_);
  }
}

// Rows, then columns; the border is repeated.
void CaptureErrors::blur(float* pixels) {
  const std::vector<float>& weights = drawn_.weights();
  const int reach = static_cast<int>(weights.size()) - 1;
  for (int row = 0; row < height_; ++row) {
    const float* const in = pixels + static_cast<std::ptrdiff_t>(row) * width_;
    float* const out = rows_.data() + static_cast<std::ptrdiff_t>(row) * width_;
    float* const middle = padded_.data() + reach;
    std::copy_n(in, width_, middle);
    std::fill_n(padded_.data(), reach, in[0]);
    std::fill_n(middle + width_, reach, in[width_ - 1]);
    scale_into(out, middle, weights[0], width_);
    for (int k = 1; k <= reach; ++k)
      add_scaled_pair(out, middle - k, middle + k, weights[static_cast<std::size_t>(k)], width_);
  }
  const auto line = [&](int row) {
    return rows_.data() + static_cast<std::ptrdiff_t>(std::clamp(row, 0, height_ - 1)) * width_;
  };
  for (int row = 0; row < height_; ++row) {
    float* const out = pixels + static_cast<std::ptrdiff_t>(row) * width_;
    scale_into(out, line(row), weights[0], width_);
    for (int k = 1; k <= reach; ++k)
      add_scaled_pair(out, line(row - k), line(row + k), weights[static_cast<std::size_t>(k)], width_);
  }
}

void CaptureErrors::read_out(float* pixels, int first, int count) {
  const ErrorLevels& levels = drawn_.levels();
  const auto pattern = [&](const std::vector<float>& all) { return all.empty() ? nullptr : all.data() + first; };
  apply_gain(pixels, pattern(pixel_gain_), levels.pixel_gain, levels.gain, count);
  if (levels.gamma != 1.0F) apply_gamma(pixels, levels.gamma, levels.white, count);
  if (const float* const offsets = pattern(pixel_offset_)) add_scaled(pixels, offsets, levels.pixel_offset, count);
  if (levels.offset != 0.0F) add_offset(pixels, levels.offset, count);
  if (levels.read_noise > 0) {
    draw_words(kReadNoise, levels.frame_seed, first, count);
    add_normal(pixels, levels.read_noise, words_, count);
  }
  if (levels.full_scale > 0) quantise(pixels, levels.full_scale, levels.steps, count);
}

}  // namespace relign::imaging
