// Checks whether a mesh can be the surface of a piece of glass, and reports what is wrong and where.
#pragma once

#include <string>

#include "meshes/mesh.h"

namespace relign::meshes {

enum class Demand {
  surface,  // faces with finite corners: sufficient for absorbing parts
  body      // also closed, with faces of non-zero area that look outwards: glass
};

// Throws Error(bad_input) that names `file`, the first face of each kind of mistake, and what to do. `mesh` is welded.
void check_mesh(const Mesh& mesh, Demand demand, const std::string& file);

}  // namespace relign::meshes
