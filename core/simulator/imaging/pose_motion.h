// How the lens moves with each axis of a pose.
#pragma once

#include <array>
#include <vector>

#include "imaging/scene_file.h"
#include "optics/assembly.h"

namespace relign::imaging {

// Shift (mm) and turn (rad) about the lens's origin, lens coordinates.
using Twist = std::array<double, 6>;

// Per unit of each axis of a true pose (half the travel is half a unit).
std::vector<Twist> twists_of_axes(const SceneFile& scene, const std::vector<double>& true_pose);
// Of an element that has this offset: per mm of its shift along x, y, z and per degree of its tilt about x, y.
std::vector<Twist> twists_of_offset(double pivot_z_mm, const optics::ElementOffset& offset);

}  // namespace relign::imaging
