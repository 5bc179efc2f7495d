// Draws the imaging errors of captures: numbers, blobs and rings, no pixels. Applied on the CPU by capture_errors.h, on
// a GPU by gpu/read_out_steps.h.
#pragma once

#include <cstdint>
#include <optional>
#include <relign/random.hpp>
#include <vector>

#include "imaging/imaging_errors.h"
#include "imaging/pixel_steps.h"
#include "imaging/sensor.h"
#include "imaging/stray_light.h"
#include "optics/rigid.h"

namespace relign::imaging {

class DrawnErrors {
 public:
  // white: level of a lit pixel. target_side_mm: of the emitter.
  DrawnErrors(const ImagingErrors& errors, const Sensor& sensor, double white, double target_side_mm);

  // Draws the errors of one capture, before it is rendered. False: it stays as rendered; the others have no meaning.
  bool draw(std::uint64_t frame_seed);

  // From the world to the coordinates of the ideal print, in the emitter's plane: a similarity. Empty: an ideal print.
  const std::optional<optics::Motion>& into_print() const { return into_print_; }
  const ErrorLevels& levels() const { return levels_; }
  // Of the blur: centre, first neighbour, ...; one entry: no blur.
  const std::vector<float>& weights() const { return weights_; }
  std::size_t most_weights() const { return most_weights_; }  // of any capture
  const StrayLight* stray_light() const { return has_stray_light_ ? &*stray_light_ : nullptr; }
  // Calls light(pixel) for the places of the station's hot pixels, perhaps twice for one.
  template <class Light>
  void for_hot_pixels(const Light& light) const;

  // How many stations have been drawn: with the same number, the same patterns and stray light.
  std::uint64_t stations() const { return stations_; }
  const ImagingErrors& errors() const { return errors_; }  // what may be drawn
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  // Streams of the seeds of station and frame. Upper half: apart from those of rays and of paths (path_random.h).
  static constexpr std::uint64_t kTag = 0x65727273ULL << 32;
  static constexpr std::uint64_t kStationValues = kTag, kFrameValues = kTag + 1, kHotPixels = kTag + 2,
                                 kPatternSeed = kTag + 3, kWhichErrors = kTag + 4;

  void draw_station(std::uint64_t seed);
  // The errors without those that a station does not have.
  ImagingErrors station_errors(std::uint64_t seed) const;
  void set_vignetting(float loss, float centre_x, float centre_y);
  void set_blur(double sigma_px);

  ImagingErrors errors_;
  int width_, height_;
  double file_pixel_;  // pixel of the scene file's sensor, in pixels of this one
  double target_side_mm_;
  std::uint64_t stations_ = 0, station_seed_ = 0;
  ErrorLevels levels_{};
  double hot_pixels_ = 0;  // share
  std::optional<optics::Motion> into_print_;
  std::size_t most_weights_;
  std::vector<float> weights_;
  std::optional<StrayLight> stray_light_;
  bool has_stray_light_ = false;
};

template <class Light>
void DrawnErrors::for_hot_pixels(const Light& light) const {
  if (!(hot_pixels_ > 0)) return;
  Random random(station_seed_, kHotPixels);
  const auto all = static_cast<std::uint64_t>(width_) * static_cast<std::uint64_t>(height_);
  const auto hot = static_cast<std::uint64_t>(hot_pixels_ * static_cast<double>(all) + random.uniform());
  for (std::uint64_t i = 0; i < hot; ++i) light(random.below(all));
}

}  // namespace relign::imaging
