// Meshes in files: PLY, STL, OBJ.
#pragma once

#include <filesystem>
#include <string>

#include "meshes/mesh.h"
#include "meshes/mesh_check.h"

namespace relign::meshes {

// Reads, welds and checks a mesh; polygons become fans of triangles. Throws Error: io when the file cannot be read,
// bad_input when it is no such file, is truncated or too large, or does not meet `demand` (see mesh_check.h).
Mesh read_mesh(const std::filesystem::path& file, Demand demand);

// Binary PLY, little-endian, float.
std::string ply_of(const Mesh& mesh);

}  // namespace relign::meshes
