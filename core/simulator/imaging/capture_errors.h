// Applies imaging errors to captures.
//
// Rendered capture (with the errors of the target) -> vignetting -> stray light -> blur -> photon noise -> pixel gain
// -> gain -> gamma -> pixel offset, offset, read noise -> full scale and quantisation, hot pixels. A scene's own
// electronics (read_out.h) come before. A pure function of (errors, values, frame seed), the same bits everywhere.
#pragma once

#include <cstdint>
#include <optional>
#include <relign/random.hpp>
#include <vector>

#include "imaging/imaging_errors.h"
#include "imaging/sensor.h"
#include "imaging/stray_light.h"
#include "optics/ray_block.h"
#include "optics/rigid.h"

namespace relign::imaging {

class CaptureErrors {
 public:
  // white: level of a lit pixel. target_side_mm: of the emitter.
  CaptureErrors(const ImagingErrors& errors, const Sensor& sensor, double white, double target_side_mm);

  // Draws the errors of one capture, before it is rendered. False: it stays as rendered; do not call the others.
  bool draw(std::uint64_t frame_seed);
  // From the world to the coordinates of the ideal print, in the emitter's plane: a similarity. Empty: an ideal print.
  const std::optional<optics::Motion>& into_print() const { return into_print_; }
  // In place, sensor.pixels() values.
  void apply(float* pixels);

 private:
  struct Levels {
    float vignetting = 0, centre_x = 0, centre_y = 0;  // centre as a share of the image's side, from its middle
    float photon = 0, pixel_gain = 0, gain = 1, gamma = 1, pixel_offset = 0, offset = 0, read_noise = 0;
    float full_scale = 0, steps = 0, hot_pixels = 0;  // full_scale 0: not limited
    bool stray_light = false;
  };
  void draw_station(std::uint64_t seed);
  // The errors without those that a station does not have.
  ImagingErrors drawn_errors(std::uint64_t seed) const;
  void set_blur(double sigma_px);
  void draw_words(std::uint32_t stream, std::uint64_t seed, int first, int count);
  void draw_patterns();
  void add_light(float* pixels) const;
  void blur(float* pixels);
  void read_out(float* pixels, int first, int count);
  void light_hot_pixels(float* pixels) const;

  ImagingErrors errors_;
  int width_, height_;
  double file_pixel_;  // pixel of the scene file's sensor, in pixels of this one
  float white_;
  double target_side_mm_;
  bool drawn_ = false;  // the station of errors that are drawn once
  std::uint64_t station_seed_ = 0, frame_seed_ = 0;

  Levels levels_;
  std::optional<optics::Motion> into_print_;
  std::vector<float> weights_;  // of the blur: centre, first neighbour, ...; one entry: no blur
  std::optional<StrayLight> stray_light_;
  std::vector<float> pixel_gain_, pixel_offset_;  // patterns of standard deviation 1
  std::vector<float> rows_, padded_;              // for the blur
  optics::RayBlock words_{};
};

}  // namespace relign::imaging
