// Rays of one object point in the y-z plane, as many as fit through a lens: what drawings of lenses show.
#pragma once

#include <optional>
#include <vector>

#include "optics/trace.h"

namespace relign::optics {

struct FanRay {
  Ray start;
  TracedRay traced;  // passed
};

// `count` rays (at least 1) of the object point at `field_deg`, in even steps across what the mesh apertures let
// through, rim to rim; a single one goes through the middle. Light of positive fields travels towards +y. The point
// lies on the plane z = `object_z_mm` (lens coordinates, before the first vertex), seen from the middle of the
// paraxial entrance pupil; without a plane it is far away.
//
// The rims are found by looking, since the entrance pupil of a wide-angle lens moves and tilts with the field: rays
// aimed at many heights in the paraxial pupil's plane, then bisection at both ends of the largest run that passes.
// Empty when nothing passes.
std::vector<FanRay> ray_fan(const Assembly& assembly, double field_deg, std::optional<double> object_z_mm, int count);

}  // namespace relign::optics
