#include "imaging/sensor.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/text.h"

namespace relign::imaging {
namespace {

constexpr int kMaxPixels = 16384;         // a side
constexpr double kMaxInAll = 64.0 * 1e6;  // an image of 256 MB

Electronics read_electronics(const JsonSource& source, const std::string& at, std::vector<Problem>& problems) {
  ObjectReader reader(source, at, problems);
  Electronics electronics;
  electronics.saturation = reader.required_number("saturation", 1e-12, 1e12);
  electronics.full_well_electrons = reader.required_number("full_well_electrons", 1, 1e12);
  electronics.read_noise_electrons = reader.number("read_noise_electrons", 0, 0, 1e9);
  electronics.bits = static_cast<int>(reader.integer("bits", 0, 0, 16));
  reader.reject_unknown();
  return electronics;
}

// Reads columns and rows; leaves them 0 after a mistake.
void read_pixels(ObjectReader& reader, Sensor& sensor) {
  const Json* pixels = reader.get("pixels");
  if (pixels && pixels->is_array()) {
    const std::vector<double> both = reader.numbers("pixels", 2, {1, 1});
    const double pitch_um = reader.required_number("pitch_um", 1e-3, 1e6);
    if (reader.get("side_mm"))
      reader.complain("side_mm", "'pixels' lists columns and rows: use 'pitch_um' instead of 'side_mm'");
    for (const double count : both)
      if (!(count >= 1 && count <= kMaxPixels && count == std::floor(count))) {
        reader.complain("pixels", "columns and rows must be integers from 1 to " + std::to_string(kMaxPixels) +
                                      ", found " + shortest(count));
        return;
      }
    if (both[0] * both[1] > kMaxInAll) {
      reader.complain("pixels", "more than 64 million pixels; use a smaller sensor");
      return;
    }
    sensor.width = static_cast<int>(both[0]);
    sensor.height = static_cast<int>(both[1]);
    sensor.pitch_mm = pitch_um / 1000;
    sensor.left_mm = -sensor.width * sensor.pitch_mm / 2;
    sensor.top_mm = sensor.height * sensor.pitch_mm / 2;
    return;
  }
  const double side = reader.required_number("side_mm", 1e-6, 1e6);
  if (reader.get("pitch_um"))
    reader.complain("pitch_um", "'side_mm' determines the pitch; to set 'pitch_um', write \"pixels\": [columns, rows]");
  sensor.width = sensor.height = static_cast<int>(reader.integer("pixels", 200, 1, 4096));
  sensor.pitch_mm = side / sensor.width;
  sensor.left_mm = -side / 2;
  sensor.top_mm = side / 2;
}

void read_region(ObjectReader& reader, const JsonSource& source, std::vector<Problem>& problems, Sensor& sensor) {
  ObjectReader region(source, reader.pointer_to("region"), problems);
  const auto number = [&](const char* key, int fallback, int low, int high) {
    return static_cast<int>(region.integer(key, fallback, low, high));
  };
  const int column = number("column", 0, 0, sensor.width - 1), row = number("row", 0, 0, sensor.height - 1);
  const int columns = number("columns", sensor.width - column, 1, sensor.width);
  const int rows = number("rows", sensor.height - row, 1, sensor.height);
  region.reject_unknown();
  if (column + columns > sensor.width || row + rows > sensor.height) {
    region.complain("", "the region ends at column " + std::to_string(column + columns) + " and row " +
                            std::to_string(row + rows) + ", beyond the sensor's " +
                            counted(static_cast<std::uint64_t>(sensor.width), "column") + " and " +
                            counted(static_cast<std::uint64_t>(sensor.height), "row"));
    return;
  }
  sensor.left_mm += column * sensor.pitch_mm;
  sensor.top_mm -= row * sensor.pitch_mm;
  sensor.width = columns;
  sensor.height = rows;
}

}  // namespace

double Sensor::half_extent_mm() const {
  const double right = left_mm + width * pitch_mm, bottom = top_mm - height * pitch_mm;
  return std::max({std::fabs(left_mm), std::fabs(right), std::fabs(top_mm), std::fabs(bottom)});
}

Sensor read_sensor(const JsonSource& source, const std::string& pointer, int columns, std::vector<Problem>& problems) {
  ObjectReader reader(source, pointer, problems);
  Sensor sensor;
  sensor.z_mm = reader.required_number("z_mm", 1e-3, 1e6);
  read_pixels(reader, sensor);
  if (sensor.width > 0 && reader.get("region")) {
    if (columns > 0)
      reader.complain("region", "a region counts in the pixels of the file; leave the parameter 'pixels' at 0");
    else
      read_region(reader, source, problems, sensor);
  }
  sensor.file_pitch_mm = sensor.pitch_mm;
  if (columns > 0 && sensor.width > 0) {
    const double width_mm = sensor.pitch_mm * sensor.width;
    sensor.height =
        std::max(1, static_cast<int>(std::lround(static_cast<double>(columns) * sensor.height / sensor.width)));
    sensor.width = columns;
    sensor.pitch_mm = width_mm / columns;
    sensor.top_mm = sensor.height * sensor.pitch_mm / 2;
  }
  if (reader.get("electronics"))
    sensor.electronics = read_electronics(source, reader.pointer_to("electronics"), problems);
  reader.reject_unknown();
  return sensor;
}

}  // namespace relign::imaging
