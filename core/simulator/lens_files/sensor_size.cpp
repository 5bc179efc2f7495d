#include "lens_files/sensor_size.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "lens_files/text_lines.h"

namespace relign::lens_files {

SensorSize SensorSize::square(double side_mm) {
  SensorSize sensor;
  sensor.pitch_mm = side_mm / sensor.columns;
  return sensor;
}

bool SensorSize::has_usual_pixels() const {
  const SensorSize usual;
  return columns == usual.columns && rows == usual.rows;
}

SensorSize parse_sensor(const std::string& text, const std::string& option) {
  constexpr double kLargest_mm = 1000;
  constexpr int kMaxPixels = 8000;
  const auto expect = [&](bool met, const std::string& what) {
    if (!met)
      throw Error(
          ErrorKind::bad_input,
          option + " '" + text + "': expected " + what +
              "; write columns, rows and the pitch in um, such as 1920x1280@3.45, or the side of a square in mm, such "
              "as 4.8");
  };
  const std::size_t cross = text.find('x'), at = text.find('@');
  if (cross == std::string::npos && at == std::string::npos) {
    const double side = parse_number(text).value_or(0);
    expect(side > 0 && side <= kLargest_mm, "a side of up to 1000 mm");
    return SensorSize::square(side);
  }
  const auto columns = parse_number(text.substr(0, cross)), rows = parse_number(text.substr(cross + 1, at - cross - 1));
  std::string pitch = text.substr(at + 1);
  for (const std::string unit : {"um", "\u00b5m", "\u03bcm"})
    if (pitch.size() > unit.size() && pitch.compare(pitch.size() - unit.size(), unit.size(), unit) == 0)
      pitch.resize(pitch.size() - unit.size());
  while (!pitch.empty() && pitch.back() == ' ') pitch.pop_back();
  const auto pitch_um = parse_number(pitch);
  expect(cross < at && at != std::string::npos && columns && rows && pitch_um, "COLUMNSxROWS@PITCH");
  for (const double count : {*columns, *rows})
    expect(count >= 1 && count <= kMaxPixels && count == std::floor(count),
           "1 to " + std::to_string(kMaxPixels) + " pixels a side");
  const double pitch_mm = *pitch_um / 1000;
  expect(*pitch_um >= 1e-3 && pitch_mm * std::max(*columns, *rows) <= kLargest_mm, "a sensor of up to 1000 mm");
  return {static_cast<int>(*columns), static_cast<int>(*rows), pitch_mm};
}

std::string chart_for(const SensorSize& sensor) {
  constexpr int kMost = 9, kFewest = 2;
  constexpr double kSquare_px = 42;  // half of the spacing; fields need 40
  const int squares = static_cast<int>(std::max(sensor.columns, sensor.rows) / (2 * kSquare_px));
  return "camera_chart:squares=" + std::to_string(std::clamp(squares, kFewest, kMost));
}

}  // namespace relign::lens_files
