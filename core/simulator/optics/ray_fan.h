// Rays of one object point in the y-z plane that fill the aperture of a lens, for drawings.
#pragma once

#include <optional>
#include <vector>

#include "optics/trace.h"

namespace relign::optics {

struct FanRay {
  Ray start;
  TracedRay traced;  // passed
};

// `count` rays (at least 1) of the object point at `field_deg`, in even steps from rim to rim of what the mesh
// apertures transmit; a single ray goes through the middle. Light of positive fields travels towards +y. The point is
// on the plane z = `object_z_mm` (lens coordinates, in front of the first vertex), with the field angle at the centre
// of the paraxial entrance pupil; without a plane it is at infinity.
//
// The rims are found by a scan, since the entrance pupil of a wide-angle lens moves and tilts with the field: rays are
// aimed at many heights in the paraxial pupil's plane, then bisected at both ends of the longest run that passes. Empty
// if no ray passes.
std::vector<FanRay> ray_fan(const Assembly& assembly, double field_deg, std::optional<double> object_z_mm, int count);

}  // namespace relign::optics
