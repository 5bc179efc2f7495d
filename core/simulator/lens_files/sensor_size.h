// The size of a sensor as users state it, and the chart that suits it.
#pragma once

#include <string>

namespace relign::lens_files {

struct SensorSize {
  int columns = 200, rows = 200;  // of a sensor of which only the side is stated
  double pitch_mm = 0;
  double shorter_side_mm() const { return (columns < rows ? columns : rows) * pitch_mm; }
  double longer_side_mm() const { return (columns < rows ? rows : columns) * pitch_mm; }
  // A square with the usual number of pixels.
  static SensorSize square(double side_mm);
  bool has_usual_pixels() const;
};

// "1920x1280@3.45" or "1920x1280@3.45um" (columns, rows, pitch in um) or "4.8" (side of a square in mm) of `option`.
// Throws Error(bad_input) for sensors that a scene does not allow.
SensorSize parse_sensor(const std::string& text, const std::string& option);

// A chart of slanted squares of at least 40 pixels for this sensor, so that fields exist: "camera_chart:squares=7".
std::string chart_for(const SensorSize& sensor);

}  // namespace relign::lens_files
