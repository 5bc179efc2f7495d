// Trims stated semi-diameters to where faces do not cross: design programs write semi-diameters at which neighbouring
// faces cross, or beyond the end of a conic, and trace rays all the same.
#pragma once

#include <string>
#include <vector>

#include "optics/prescription.h"

namespace relign::lens_files {

struct Trim {
  std::size_t face = 0;  // from the front, over all elements
  double from_mm = 0, to_mm = 0;
  std::string reason;  // "is larger than the conic", for readers
};

// Trims `clear_radii`, one per face, mm, 0 if not stated; the shapes are those of `lens`, whose semi-diameters are
// ignored. Faces that cross within kMinRoom of their smaller semi-diameter are left unchanged: the lens reader
// rejects them.
inline constexpr double kMinRoom = 0.5;
std::vector<Trim> trim_clear_radii(const optics::Prescription& lens, std::vector<double>& clear_radii);

}  // namespace relign::lens_files
