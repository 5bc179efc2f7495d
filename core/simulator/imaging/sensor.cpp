#include "imaging/sensor.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "base/text.h"

namespace relign::imaging {
namespace {

constexpr double kMaxInAll = 64.0 * 1e6;  // pixels: an image of 256 MB

using Complain = std::function<void(const char* key, const std::string& message)>;  // at a key of the sensor

// Leaves columns and rows 0 after a mistake.
void read_pixels(const Json& file, const Complain& complain, Sensor& sensor) {
  const bool both = file.contains("pixels") && file["pixels"].is_array();
  const char* const needed = both ? "pitch_um" : "side_mm";
  if (!file.contains(needed)) return complain("", std::string("missing key '") + needed + "' (number)");
  if (both && file.contains("side_mm"))
    complain("side_mm", "'pixels' lists columns and rows: use 'pitch_um' instead of 'side_mm'");
  if (!both && file.contains("pitch_um"))
    complain("pitch_um", "'side_mm' determines the pitch; to set 'pitch_um', write \"pixels\": [columns, rows]");
  if (both && file["pixels"][0].get<double>() * file["pixels"][1].get<double>() > kMaxInAll)
    return complain("pixels", "more than 64 million pixels; use a smaller sensor");
  sensor.width = both ? file["pixels"][0].get<int>() : file.value("pixels", 200);
  sensor.height = both ? file["pixels"][1].get<int>() : sensor.width;
  sensor.pitch_mm = both ? file["pitch_um"].get<double>() / 1000 : file["side_mm"].get<double>() / sensor.width;
  sensor.left_mm = both ? -sensor.width * sensor.pitch_mm / 2 : -file["side_mm"].get<double>() / 2;
  sensor.top_mm = both ? sensor.height * sensor.pitch_mm / 2 : file["side_mm"].get<double>() / 2;
}

void read_region(const Json& region, const Complain& complain, Sensor& sensor) {
  const std::int64_t column = region["column"], row = region["row"];
  const std::int64_t columns = region.value("columns", sensor.width - column);
  const std::int64_t rows = region.value("rows", sensor.height - row);
  if (columns < 1 || rows < 1 || columns > sensor.width - column || rows > sensor.height - row)
    return complain("region", "the region ends at column " + std::to_string(column + columns) + " and row " +
                                  std::to_string(row + rows) + ", beyond the sensor's " +
                                  counted(static_cast<std::uint64_t>(sensor.width), "column") + " and " +
                                  counted(static_cast<std::uint64_t>(sensor.height), "row"));
  sensor.left_mm += static_cast<double>(column) * sensor.pitch_mm;
  sensor.top_mm -= static_cast<double>(row) * sensor.pitch_mm;
  sensor.width = static_cast<int>(columns);
  sensor.height = static_cast<int>(rows);
}

}  // namespace

double Sensor::half_extent_mm() const {
  const double right = left_mm + width * pitch_mm, bottom = top_mm - height * pitch_mm;
  return std::max({std::fabs(left_mm), std::fabs(right), std::fabs(top_mm), std::fabs(bottom)});
}

Sensor read_sensor(const Json& file, const JsonSource& source, const std::string& pointer, int columns, double warp_um,
                   std::vector<Problem>& problems) {
  const Complain complain = [&](const char* key, const std::string& message) {
    problems.push_back(source.problem(*key ? pointer + "/" + key : pointer, message));
  };
  Sensor sensor;
  sensor.z_mm = file["z_mm"];
  read_pixels(file, complain, sensor);
  if (warp_um != 0)
    sensor.bow_per_mm = warp_um / 1000 / (sensor.left_mm * sensor.left_mm + sensor.top_mm * sensor.top_mm);
  if (sensor.width > 0 && file.contains("region")) {
    if (columns > 0)
      complain("region", "a region counts in the pixels of the file; leave the parameter 'pixels' at 0");
    else
      read_region(file["region"], complain, sensor);
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
  if (const auto found = file.find("electronics"); found != file.end())
    sensor.electronics = Electronics{(*found)["saturation"], (*found)["full_well_electrons"],
                                     (*found)["read_noise_electrons"], (*found)["bits"]};
  return sensor;
}

}  // namespace relign::imaging
