// Meshes in files: PLY, STL, OBJ.
#pragma once

#include <filesystem>
#include <string>

#include "mesh/mesh.h"
#include "mesh/mesh_check.h"

namespace relign::mesh {

// Reads, welds and checks a mesh; polygons become fans of triangles. Throws Error: io when the file cannot be read,
// bad_input when it is no such file, is truncated or too large, or does not meet `demand` (see mesh_check.h).
Mesh read_mesh(const std::filesystem::path& file, Demand demand);

// Binary PLY, little-endian, float.
std::string ply_of(const Mesh& mesh);

}  // namespace relign::mesh
