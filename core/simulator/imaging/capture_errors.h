// Applies imaging errors to captures.
//
// Rendered capture (with the errors of the target) -> vignetting -> stray light -> blur -> photon noise -> pixel gain
// -> gain -> gamma -> pixel offset, offset, read noise -> full scale and quantisation, hot pixels. A scene's own
// electronics (read_out.h) come before. A pure function of (errors, values, frame seed), the same bits everywhere.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "imaging/drawn_errors.h"
#include "optics/ray_block.h"

namespace relign::imaging {

class CaptureErrors {
 public:
  // white: level of a lit pixel. target_side_mm: of the emitter.
  CaptureErrors(const ImagingErrors& errors, const Sensor& sensor, double white, double target_side_mm);

  // Draws the errors of one capture, before it is rendered. False: it stays as rendered; do not call the others.
  bool draw(std::uint64_t frame_seed) { return drawn_.draw(frame_seed); }
  const std::optional<optics::Motion>& into_print() const { return drawn_.into_print(); }
  // In place, sensor.pixels() values.
  void apply(float* pixels);

  const DrawnErrors& drawn() const { return drawn_; }

 private:
  void draw_words(std::uint32_t stream, std::uint64_t seed, int first, int count);
  void render_station();
  void draw_patterns();
  void add_light(float* pixels) const;
  void blur(float* pixels);
  void read_out(float* pixels, int first, int count);

  DrawnErrors drawn_;
  int width_, height_;
  std::uint64_t rendered_ = 0;  // the station that these are of: its number
  std::optional<StrayLightField> stray_light_;
  std::vector<float> pixel_gain_, pixel_offset_;  // patterns of standard deviation 1
  std::vector<float> rows_, padded_;              // for the blur
  optics::RayBlock words_{};
};

}  // namespace relign::imaging
