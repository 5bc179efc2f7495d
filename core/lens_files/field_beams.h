// How large faces must be for the light of the design's fields, vignetted as the file states it.
#pragma once

#include <vector>

#include "lens_files/lens_design.h"
#include "optics/prescription.h"

namespace relign::lens_files {

// For every face from the front: the largest distance from the axis at which rays of the fields meet it. Without
// vignetting factors these are five fields from the axis to the full one, through the whole stop; with factors they are
// the file's own fields, each through its part of the pupil.
std::vector<double> needed_radii(const LensDesign& design, const optics::Prescription& lens);

}  // namespace relign::lens_files
