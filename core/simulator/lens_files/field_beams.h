// How large faces must be for the light of the design's fields, vignetted as the file states it.
#pragma once

#include <optional>
#include <vector>

#include "lens_files/lens_design.h"
#include "optics/prescription.h"

namespace relign::lens_files {

// For every face from the front: the largest distance from the axis at which rays of the fields meet it. Without
// vignetting factors these are five fields from the axis to the full one, through the whole stop; with factors they are
// the file's own fields, each through its part of the pupil.
std::vector<double> needed_radii(const LensDesign& design, const optics::Prescription& lens);

// The field in degrees of which the chief ray meets the image plane at this distance from the axis, looked for up to
// one and a half times the paraxial one. Nothing where no chief ray gets there.
std::optional<double> field_of_real_height(const LensDesign& design, const optics::Prescription& lens, double height_mm,
                                           double paraxial_deg);

}  // namespace relign::lens_files
