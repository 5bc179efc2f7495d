// What the optional part mesh_import, which holds assimp, gives to its caller (relign/optional_part.hpp).
#pragma once

#include <cstddef>

namespace relign::meshes {

// Gets the pieces of a mesh one after another, each with its vertices and then its faces. Functions may throw.
class MeshReceiver {
 public:
  virtual ~MeshReceiver() = default;
  virtual void piece(std::size_t vertices) = 0;
  virtual void vertex(double x, double y, double z) = 0;
  virtual void face(const unsigned* corners, unsigned count) = 0;
};

}  // namespace relign::meshes
