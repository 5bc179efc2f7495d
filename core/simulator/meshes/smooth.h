// Where a closed mesh is smooth and where it has edges: patches, and normals for the corners of faces.
#pragma once

#include <cstdint>
#include <vector>

#include "meshes/mesh.h"

namespace relign::meshes {

// Faces that meet at a smaller angle belong to one smooth surface. Meshes of lenses turn by less from face to face
// (pitch over radius of curvature), and rims by more.
inline constexpr double kCreaseDegrees = 20;
// A flat rim around a face, square to the axis, is a surface of its own however little it turns from the face:
// triangles whose normals lie so near the z axis, unless they reach the axis.
inline constexpr double kFlatRimRadians = 3e-4;

struct CornerNormals {
  std::vector<Vec3> normals;      // unit, outwards
  std::vector<Triangle> corners;  // of each triangle: which normal each corner has
};

// Normals as of the smooth surface that the corners lie on: exact for corners on a sphere, up to the rounding of the
// file. Faces across an edge have no part in them, so that edges stay sharp. `mesh` is a checked body.
CornerNormals corner_normals(const Mesh& mesh);

struct Patches {
  std::vector<std::uint32_t> of_triangle;  // the number of its patch, from 0
  std::uint32_t count = 0;
};

// The smooth surfaces that edges divide the mesh into.
Patches smooth_patches(const Mesh& mesh);

}  // namespace relign::meshes
