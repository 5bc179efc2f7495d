// The cross-section of a lens as built, with rays: what `lens draw` shows.
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
  // y of the sensor's edges; without one the image plane reaches as far as the rays.
  std::optional<double> sensor_low_mm, sensor_high_mm;
  bool vertical = false;  // light travels downwards instead of to the right
};

// The picture in the y-z plane: elements cut by it (where they sit, tilted or not), stops, mount, image plane, axis,
// rays (those that leave the plane are projected), a scale bar. A pure function of what it is given.
std::string lens_svg(const LensPicture& picture);
Raster lens_raster(const LensPicture& picture, double pixels_per_unit);

// The line along which the plane x = 0 cuts a face, in lens coordinates, from -clear radius to +clear radius.
std::vector<optics::Vec3> face_section(const optics::Face& face, const optics::Motion& placement, int points);

}  // namespace relign::drawing
