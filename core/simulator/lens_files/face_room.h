// Trims stated semi-diameters to where faces do not cross: design programs write semi-diameters at which neighbouring
// faces cross, or beyond the end of a conic, and trace rays all the same.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "optics/prescription.h"

namespace relign::lens_files {

// Trims `semi_diameters`, one per face, mm, empty if not stated; the shapes are those of `lens`, whose semi-diameters
// are ignored. Faces that cross within kMinRoom of their smaller semi-diameter are left unchanged: the lens reader
// rejects them. Returns the reason for every face, for readers ("is larger than the conic"); empty if not trimmed.
inline constexpr double kMinRoom = 0.5;
std::vector<std::string> trim_semi_diameters(const optics::Prescription& lens,
                                             std::vector<std::optional<double>>& semi_diameters);

}  // namespace relign::lens_files
