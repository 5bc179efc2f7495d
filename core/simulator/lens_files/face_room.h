// Keeps stated clear radii within what faces leave room for: design programs write semi-diameters at which neighbouring
// faces cross, or a conic has ended, and trace rays all the same.
#pragma once

#include <string>
#include <vector>

#include "optics/prescription.h"

namespace relign::lens_files {

struct Trim {
  std::size_t face = 0;  // from the front, over all elements
  double from_mm = 0, to_mm = 0;
  std::string why;  // "crosses the face before it", for people
};

// `clear_radii`, one a face, 0 where not stated, are made smaller where that is enough; the shapes are those of `lens`,
// its clear radii are not looked at. Faces that cross within kLeastRoom of their smaller radius are left alone: such
// numbers are no lens, and whoever reads them back says so.
inline constexpr double kLeastRoom = 0.5;
std::vector<Trim> trim_clear_radii(const optics::Prescription& lens, std::vector<double>& clear_radii);

}  // namespace relign::lens_files
