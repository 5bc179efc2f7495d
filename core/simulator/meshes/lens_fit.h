// Derives the prescription of an element from its mesh: least-squares spheres through its two optical faces.
#pragma once

#include <string>

#include "meshes/mesh.h"

namespace relign::meshes {

struct FittedFace {
  double z_mm = 0;              // intersection of the sphere and the axis
  double curvature = 0;         // 1 / radius, 1/mm; positive: centre on the image side
  double tilt_deg[2] = {0, 0};  // of the sphere's normal on the axis, towards x and y
  double clear_radius_mm = 0;   // farthest corner from the axis
  double residual_rms_mm = 0;   // distances of the corners from the sphere
  double residual_largest_mm = 0;
  std::size_t corners = 0;
};

struct FittedElement {
  FittedFace front, back;  // front: towards -z
};

// `mesh` must be a checked body around the z axis. The faces are the first and the last smooth patch on the axis.
// Throws Error(bad_input) that names `file` if the axis misses the mesh, or a patch has too few corners.
FittedElement fit_element(const Mesh& mesh, const std::string& file);

}  // namespace relign::meshes
