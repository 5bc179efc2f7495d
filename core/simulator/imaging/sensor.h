// The image sensor of a scene: its pixels and its electronics.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/json_source.h"
#include "imaging/pixel_grid.h"

namespace relign::imaging {

// From the irradiance of a pixel to its grey value; see read_out.h.
struct Electronics {
  double saturation = 0;            // irradiance, for an emitter of radiance 1, that fills the well
  double full_well_electrons = 0;   // electrons of a full well
  double read_noise_electrons = 0;  // standard deviation
  int bits = 0;                     // of the converter; 0: grey values are not rounded
};

// The part of a sensor that is read out.
struct Sensor : PixelGrid {
  double file_pitch_mm = 0;  // of the scene file's pixels, whatever number of columns is chosen
  std::optional<Electronics> electronics;
  // Only these are read out, other pixels of every image are 0: whole tiles (pupil_tiles.h). Empty: all.
  std::vector<PixelBox> windows;

  std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
  // Farthest |x| or |y| from the axis.
  double half_extent_mm() const;
};

// Reads the object "sensor" of a scene file: {"z_mm", "side_mm", "pixels": 200}, or {"z_mm", "pitch_um", "pixels":
// [columns, rows]}; optionally with "region": {"column", "row", "columns", "rows"} and "electronics". `columns` above 0
// divides the same area into that many columns, and rows in proportion. warp_um: how much farther from the lens the
// corners of the whole sensor are than its centre.
// `file`: that object with defaults, as scene_schema() makes it from `pointer` of `source`.
Sensor read_sensor(const Json& file, const JsonSource& source, const std::string& pointer, int columns, double warp_um,
                   std::vector<Problem>& problems);

}  // namespace relign::imaging
