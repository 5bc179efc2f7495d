// Computes the semi-diameters that the beams of the design's fields need, vignetted as the file states.
#pragma once

#include <optional>
#include <vector>

#include "lens_files/lens_design.h"
#include "optics/prescription.h"

namespace relign::lens_files {

// For every face from the front: the largest distance of a hit from the axis, mm. Without vignetting factors: five
// fields from the axis to the full one, through the whole stop; with factors: the file's fields, each through its part
// of the pupil.
std::vector<double> needed_radii(const LensDesign& design, const optics::Prescription& lens);

// The field in degrees whose chief ray hits the image plane at this distance from the axis, searched up to 1.5 times
// the paraxial field. Empty if there is none.
std::optional<double> field_of_real_height(const LensDesign& design, const optics::Prescription& lens, double height_mm,
                                           double paraxial_deg);

}  // namespace relign::lens_files
