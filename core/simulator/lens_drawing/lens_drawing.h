// Drawing of the cross-section of a lens as built, with rays, for `lens draw`.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drawing/canvas.h"
#include "optics/assembly.h"
#include "optics/ray_fan.h"

namespace relign::drawing {

// Rays of one colour.
struct DrawnFan {
  std::string label;       // "20 deg"
  std::size_t series = 0;  // number of the colour
  std::vector<optics::FanRay> rays;
};

struct LensPicture {
  const optics::Assembly* assembly = nullptr;
  std::string title, subtitle;
  std::vector<DrawnFan> fans;
  // y of the sensor's edges; without them the image plane extends as far as the rays.
  std::optional<double> sensor_low_mm, sensor_high_mm;
  bool vertical = false;  // light travels downwards instead of to the right
};

// The picture in the y-z plane: sections of the elements as placed, stops, barrel, image plane, axis, rays (projected
// onto the plane), a scale bar. A pure function of its argument.
std::string lens_svg(const LensPicture& picture);
Raster lens_raster(const LensPicture& picture, double pixels_per_unit);

// The section of a face with the plane x = 0, in lens coordinates, from rim to rim.
std::vector<optics::Vec3> face_section(const optics::Face& face, const optics::Motion& placement, int points);

}  // namespace relign::drawing
