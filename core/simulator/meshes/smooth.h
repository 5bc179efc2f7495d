// Smooth patches of a closed mesh, and normals for the corners of its faces.
#pragma once

#include <cstdint>
#include <vector>

#include "meshes/mesh.h"

namespace relign::meshes {

// Faces at a smaller angle to each other belong to one smooth surface. Optical faces of lens meshes turn by less from
// face to face (pitch over radius of curvature), rims by more.
inline constexpr double kCreaseDegrees = 20;
// A flat rim around a face, perpendicular to the axis, is a separate surface however small its angle to the face:
// triangles whose normals are this close to the z axis, unless their surface reaches the axis.
inline constexpr double kFlatRimRadians = 3e-4;

struct CornerNormals {
  std::vector<Vec3> normals;      // unit, outwards
  std::vector<Triangle> corners;  // per triangle: index of the normal of each corner
};

// Normals of the smooth surface through the corners: exact for corners on a sphere, up to the rounding of the file.
// Faces across an edge do not contribute, so that edges stay sharp. `mesh` must be a checked body.
CornerNormals corner_normals(const Mesh& mesh);

struct Patches {
  std::vector<std::uint32_t> of_triangle;  // the number of its patch, from 0
  std::uint32_t count = 0;
};

// Divides the mesh into smooth surfaces at its edges.
Patches smooth_patches(const Mesh& mesh);

}  // namespace relign::meshes
