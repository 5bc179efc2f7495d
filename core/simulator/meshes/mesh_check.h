// Whether a mesh can be the surface of a piece of glass, and what is wrong with it and where.
#pragma once

#include <string>

#include "meshes/mesh.h"

namespace relign::meshes {

enum class Demand {
  surface,  // faces with finite corners: enough for what absorbs
  body      // besides closed, every face with an area and looking outwards: glass
};

// Throws Error(bad_input) that names `file`, the first face of each kind of mistake, and what to do. `mesh` is welded.
void check_mesh(const Mesh& mesh, Demand demand, const std::string& file);

}  // namespace relign::meshes
