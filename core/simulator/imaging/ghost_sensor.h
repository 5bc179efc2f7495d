// How a sensor scatters light that arrives on paths with reflections, for CPU and GPU. NVRTC compiles this header.
#pragma once

#include "imaging/pixel_grid.h"
#include "optics/ghost_steps.h"

namespace relign::imaging {

struct ScatterPlace {
  double x, y;  // world, mm
  std::int32_t pixel;
};

// Whether a ray that left the lens towards the image meets the sensor: `ray` in lens coordinates, `there` in the world.
// bore: of the barrel, null: none. Sets where.
RELIGN_DEVICE bool meets_sensor(const PixelGrid& sensor, const optics::Op* bore, const optics::GhostRay& ray,
                                const optics::FloatRay& there, ScatterPlace& place) {
  if (!(there.lz > 0)) return false;
  const float t = (static_cast<float>(sensor.z_mm) - there.z) / there.lz;
  place.x = static_cast<double>(there.x + t * there.lx);
  place.y = static_cast<double>(there.y + t * there.ly);
  const double column = (place.x - sensor.left_mm) / sensor.pitch_mm, row = (sensor.top_mm - place.y) / sensor.pitch_mm;
  if (!(column > 0 && column < sensor.width && row > 0 && row < sensor.height)) return false;
  if (bore != nullptr) {
    const float to_rim = (bore->vertex_z - ray.z) / ray.n, at_rim = to_rim < t ? to_rim : t;
    const float x = ray.x + at_rim * ray.l, y = ray.y + at_rim * ray.m;
    if (!(x * x + y * y < bore->clear_radius2)) return false;
  }
  place.pixel = static_cast<std::int32_t>(row) * sensor.width + static_cast<std::int32_t>(column);
  return true;
}

// The tag of a path that the sensor scatters.
RELIGN_DEVICE std::uint32_t scattered(std::uint32_t tag) {
  return ((tag & ~(optics::kGhostReflected | optics::kGhostLeftFace)) | optics::kGhostFaint) + optics::kGhostEvent;
}

}  // namespace relign::imaging
