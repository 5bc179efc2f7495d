// The prescription of an element, found from its mesh: least-squares spheres through its two optical faces.
#pragma once

#include <string>

#include "meshes/mesh.h"

namespace relign::meshes {

struct FittedFace {
  double z_mm = 0;              // where the sphere meets the axis
  double curvature = 0;         // 1 / radius, 1/mm; positive: centre on the image side
  double tilt_deg[2] = {0, 0};  // of the sphere on the axis: how its normal there leans to x and y
  double clear_radius_mm = 0;   // farthest corner from the axis
  double residual_rms_mm = 0;   // distances of the corners from the sphere
  double residual_largest_mm = 0;
  std::size_t corners = 0;
};

struct FittedElement {
  FittedFace front, back;  // front: towards -z
};

// `mesh` is a checked body whose axis is the z axis. The faces are the smooth patches that the axis meets first and
// last. Throws Error(bad_input) that names `file` when it meets none, or a patch with too few corners.
FittedElement fit_element(const Mesh& mesh, const std::string& file);

}  // namespace relign::meshes
