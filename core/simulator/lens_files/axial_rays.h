// Rays for laying out scenes from design files: fans through the stop, best focus, image height.
#pragma once

#include <optional>
#include <vector>

#include "optics/prescription.h"
#include "optics/trace.h"

namespace relign::lens_files {

struct FanRay {
  optics::TracedRay traced;
  double front_height_mm = 0;  // y on the plane of the first vertex
  double stop_height_mm = 0;   // y on the stop's plane
};

// The beam of one object point through the stop: rays in the y-z plane with field angle `field_deg` at the entrance
// pupil, from an object plane `distance_mm` in front of the first vertex (0: infinity), in order from rim to rim of the
// stop. Ignores semi-diameters. Empty if no ray reaches the image plane.
std::vector<FanRay> beam(const optics::Prescription& lens, double field_deg, double distance_mm);

// The largest field from half of `field_deg` up to it with a ray through the stop's centre; empty if there is none.
std::optional<double> largest_field(const optics::Prescription& lens, double field_deg, double distance_mm);

// z (from the first vertex) of the smallest RMS spot of an object point on the axis, of rays within the semi-diameters.
// Throws Error(bad_input) if none passes the stop or they do not converge.
double best_focus_z(const optics::Prescription& lens, double distance_mm);

// Height of the chief ray on the plane z. Throws Error(bad_input) if no ray passes the stop's centre.
double image_height(const optics::Prescription& lens, double field_deg, double distance_mm, double z_mm);

}  // namespace relign::lens_files
