// The optional part mesh_import (relign/optional_part.hpp): the only file that includes assimp.
#include <assimp/config.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>

#include "meshes/mesh_import.h"

// False for a file that is not a mesh.
extern "C" __attribute__((visibility("default"))) bool relign_import_mesh(const char* file,
                                                                          relign::meshes::MeshReceiver& receiver) {
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  const aiScene* scene = importer.ReadFile(file, 0);
  if (!scene) return false;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& piece = *scene->mMeshes[m];
    receiver.piece(piece.mNumVertices);
    for (unsigned v = 0; v < piece.mNumVertices; ++v) {
      const aiVector3D& p = piece.mVertices[v];
      receiver.vertex(static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
    }
    for (unsigned f = 0; f < piece.mNumFaces; ++f) receiver.face(piece.mFaces[f].mIndices, piece.mFaces[f].mNumIndices);
  }
  return true;
}
