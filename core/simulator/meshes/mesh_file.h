// Meshes in files: PLY, STL, OBJ.
#pragma once

#include <filesystem>
#include <string>

#include "meshes/mesh.h"
#include "meshes/mesh_check.h"

namespace relign::meshes {

// Reads, welds and checks a mesh; polygons become fans of triangles. Throws Error: io if the file is unreadable,
// bad_input if it has another format, is truncated or too large, or does not meet `demand` (mesh_check.h).
Mesh read_mesh(const std::filesystem::path& file, Demand demand);

// Binary PLY, little-endian, float.
std::string ply_of(const Mesh& mesh);

}  // namespace relign::meshes
