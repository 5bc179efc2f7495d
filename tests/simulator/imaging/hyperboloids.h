// A lens of two hyperboloids, without aberrations on its axis.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "imaging/scene_file.h"

namespace relign::imaging {

// A lens without aberrations on its axis: light of a point at the front focus of a hyperboloid (conic -n^2) runs in the
// glass along the axis, and the second hyperboloid, its mirror image, unites it as far behind. Turned upside down, at
// life size; a ray leaves at the angle at which it came.
inline constexpr double kIndex = 1.5;
inline constexpr double kFocus_mm = 100;     // object to first vertex, last vertex to image
inline constexpr double kStopRadius_mm = 2;  // close to the first vertex: NA 0.02

inline SceneFile hyperbolic_scene() {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(testing::TempDir()) / ("relign-hyperboloids-" + std::to_string(::getpid()));
  fs::create_directories(folder);
  const double radius = kFocus_mm * (kIndex - 1);
  const Json face = {{"conic", -kIndex * kIndex}, {"clear_radius_mm", 10}, {"listing_clear_radius_mm", 10}};
  Json front = face, back = face;
  front.update({{"z_mm", 0}, {"radius_mm", radius}, {"index_after", kIndex}});
  back.update({{"z_mm", 10}, {"radius_mm", -radius}});
  std::ofstream(folder / "lens.json") << Json{
      {"format", 1},
      {"name", "hyperboloids"},
      {"source", "closed form"},
      {"wavelength_nm", 550},
      {"half_field_deg", 0.01},
      {"pivot_z_mm", 0},
      {"image_z_mm", 10 + kFocus_mm},
      {"elements", {{{"name", "L1"}, {"faces", {front, back}}}}},
      {"stops", {{{"name", "stop"}, {"z_mm", -1e-3}, {"opening_radius_mm", kStopRadius_mm}, {"aperture", true}}}}};
  std::ofstream(folder / "scene.json") << Json{
      {"use", "lens_system"},
      {"format", 1},
      {"name", "hyperboloids"},
      {"lens", "lens.json"},
      {"pivot_behind_first_vertex_mm", 0},
      {"sensor", {{"z_mm", 10 + kFocus_mm}, {"side_mm", 0.01}, {"pixels", 20}}},
      {"emitter", {{"z_mm", -kFocus_mm}, {"side_mm", 0.01}, {"target", "white"}, {"texels", 2}}},
      {"travel", {{"shift_mm", {1, 1, 1}}, {"tilt_deg", {1, 1}}}}};
  SceneFile scene = read_scene_file(folder / "scene.json", {});
  fs::remove_all(folder);
  return scene;
}

}  // namespace relign::imaging
