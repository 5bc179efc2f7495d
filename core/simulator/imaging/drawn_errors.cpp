#include "imaging/drawn_errors.h"

#include <algorithm>

#include "optics/elementary.h"

namespace relign::imaging {
namespace {

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

DrawnErrors::DrawnErrors(const ImagingErrors& errors, const Sensor& sensor, double white, double target_side_mm)
    : errors_(errors),
      width_(sensor.width),
      height_(sensor.height),
      file_pixel_(sensor.file_pitch_mm / sensor.pitch_mm),
      target_side_mm_(target_side_mm),
      most_weights_(gaussian_weights(errors.blur_px.high * file_pixel_).size()) {
  levels_.white = static_cast<float>(white);
  if (errors.stray_light) stray_light_.emplace(width_, height_);
  weights_.reserve(most_weights_);
}

bool DrawnErrors::draw(std::uint64_t frame_seed) {
  Random random(frame_seed, kFrameValues);
  if (random.uniform() >= errors_.share) return false;
  levels_.frame_seed = random.bits64();
  if (errors_.each_capture)
    draw_station(levels_.frame_seed);
  else if (stations_ == 0)
    draw_station(errors_.seed);
  return true;
}

ImagingErrors DrawnErrors::station_errors(std::uint64_t seed) const {
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

void DrawnErrors::draw_station(std::uint64_t seed) {
  ++stations_;
  station_seed_ = seed;
  const ImagingErrors errors = station_errors(seed);
  Random random(seed, kStationValues);
  const auto drawn = [&](const Range& range) { return static_cast<float>(range.draw(random)); };
  const float white = levels_.white;
  const float loss = drawn(errors.vignetting), centre_x = drawn({-0.1, 0.1}), centre_y = drawn({-0.1, 0.1});
  set_vignetting(loss, centre_x, centre_y);
  set_blur(errors.blur_px.draw(random) * file_pixel_);
  levels_.photon = white * drawn(errors.photon);
  levels_.pixel_gain = drawn(errors.pixel_gain);
  levels_.gain = drawn(errors.gain);
  levels_.gamma = drawn(errors.gamma);
  levels_.pixel_offset = white * drawn(errors.pixel_offset);
  levels_.offset = white * drawn(errors.offset);
  levels_.read_noise = white * drawn(errors.read_noise);
  hot_pixels_ = static_cast<double>(drawn(errors.hot_pixels));
  const float full_scale = white * drawn(errors.full_scale.value_or(Range{}));
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
  has_stray_light_ = errors.stray_light.has_value();
  if (has_stray_light_) stray_light_->draw(*errors.stray_light, random);
  levels_.pattern_seed = Random(seed, kPatternSeed).bits64();
}

// loss: at the corner. centre_x, centre_y: shares of the image's longer side.
void DrawnErrors::set_vignetting(float loss, float centre_x, float centre_y) {
  const auto width = static_cast<float>(width_), height = static_cast<float>(height_);
  const float longer = std::max(width, height);
  levels_.vignetting = {loss / (0.25F * (width * width + height * height)), 0.5F * (1 - width) - centre_x * longer,
                        0.5F * (1 - height), centre_y * longer};
}

void DrawnErrors::set_blur(double sigma_px) {
  weights_.clear();
  for (const double weight : gaussian_weights(sigma_px)) weights_.push_back(static_cast<float>(weight));
}

}  // namespace relign::imaging
