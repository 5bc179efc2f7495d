// Rays that scenes made of design files are laid out by: fans through the stop, best focus, the image's size.
#pragma once

#include <optional>
#include <vector>

#include "optics/prescription.h"
#include "optics/trace.h"

namespace relign::lens_files {

struct FanRay {
  optics::TracedRay traced;
  double front_height_mm = 0;  // y on the plane of the first vertex
  double stop_height_mm = 0;   // y where it meets the stop's plane
};

// The light of one point through the stop: rays in the y-z plane that come under `field_deg` at the entrance pupil,
// from an object plane `distance_mm` before the first vertex (0: from infinity), side by side from rim to rim of the
// stop. Clear radii stop nothing here. Empty where nothing gets to the image plane.
std::vector<FanRay> beam(const optics::Prescription& lens, double field_deg, double distance_mm);

// The largest field of at least half of `field_deg` under which a ray comes through the stop's centre; nothing where
// none does.
std::optional<double> largest_field(const optics::Prescription& lens, double field_deg, double distance_mm);

// z (from the first vertex) where rays of an object point on the axis are narrowest (RMS), of those that the clear
// radii let through. Throws Error(bad_input) when none passes the stop or they do not meet.
double best_focus_z(const optics::Prescription& lens, double distance_mm);

// Height of the chief ray on the plane z. Throws Error(bad_input) when there is no ray through the stop's centre.
double image_height(const optics::Prescription& lens, double field_deg, double distance_mm, double z_mm);

}  // namespace relign::lens_files
