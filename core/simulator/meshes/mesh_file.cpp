#include "meshes/mesh_file.h"

#include <assimp/config.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"
#include "meshes/mesh_header.h"

namespace relign::meshes {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxBytes = 1ULL << 30;
constexpr std::size_t kMaxTriangles = 20000000;

[[noreturn]] void reject_mesh(const fs::path& file, const std::string& message) {
  throw Error(ErrorKind::bad_input, file.string() + ": " + message);
}

std::string extension_of(const fs::path& file) {
  std::string text = file.extension().string();
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

HeaderCounts check_header(const fs::path& file) {
  const std::string extension = extension_of(file);
  if (extension != ".ply" && extension != ".stl" && extension != ".obj")
    reject_mesh(file, "unknown mesh format '" + extension + "'; allowed: .ply, .stl, .obj");
  std::error_code code;
  if (const std::uintmax_t size = fs::file_size(file, code); !code && size > kMaxBytes)
    reject_mesh(file, "the file has " + std::to_string(size) + " bytes; allowed are up to " +
                          std::to_string(kMaxBytes) + "; use a coarser mesh");
  const std::string content = read_file(file);
  if (content.empty()) reject_mesh(file, "the file is empty");
  if (extension == ".ply") return check_ply_header(file.string(), content);
  if (extension == ".stl") return check_stl_header(file.string(), content);
  return {};
}

void append(const aiMesh& part, const fs::path& file, Mesh& mesh, std::uint64_t& faces) {
  const std::size_t base = mesh.vertices.size();
  for (unsigned v = 0; v < part.mNumVertices; ++v) {
    const aiVector3D& p = part.mVertices[v];
    mesh.vertices.push_back({static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)});
  }
  for (unsigned f = 0; f < part.mNumFaces; ++f) {
    const aiFace& face = part.mFaces[f];
    ++faces;
    if (face.mNumIndices < 3)
      reject_mesh(file, "face " + std::to_string(faces) + " has " + std::to_string(face.mNumIndices) +
                            " corners; expected three or more");
    for (unsigned i = 0; i < face.mNumIndices; ++i)
      if (face.mIndices[i] >= part.mNumVertices)
        reject_mesh(file, "face " + std::to_string(faces) + " refers to vertex " + std::to_string(face.mIndices[i]) +
                              "; the mesh has " + std::to_string(part.mNumVertices));
    for (unsigned i = 2; i < face.mNumIndices; ++i) {
      const auto at = [&](unsigned corner) { return static_cast<std::uint32_t>(base + face.mIndices[corner]); };
      mesh.triangles.push_back({at(0), at(i - 1), at(i)});
      mesh.faces.push_back(static_cast<std::uint32_t>(faces));
    }
  }
}

}  // namespace

Mesh read_mesh(const fs::path& file, Demand demand) {
  const HeaderCounts header = check_header(file);
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  const aiScene* scene = importer.ReadFile(file.string(), 0);
  if (!scene) reject_mesh(file, "the file is damaged, or not a mesh of the format that its name states");
  Mesh mesh;
  std::uint64_t faces = 0;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) append(*scene->mMeshes[m], file, mesh, faces);
  if (header.faces && faces != *header.faces)
    reject_mesh(file, "the file is truncated: its header states " + counted(*header.faces, "face") + ", found " +
                          std::to_string(faces));
  if (mesh.triangles.size() > kMaxTriangles)
    reject_mesh(file, "the mesh has " + std::to_string(mesh.triangles.size()) + " triangles; allowed are up to " +
                          std::to_string(kMaxTriangles) + "; use a coarser mesh");
  mesh = welded(mesh);
  check_mesh(mesh, demand, file.string());
  return mesh;
}

std::string ply_of(const Mesh& mesh) {
  std::string text = "ply\nformat binary_little_endian 1.0\ncomment length unit = mm\nelement vertex " +
                     std::to_string(mesh.vertices.size()) +
                     "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                     std::to_string(mesh.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
  // x86-64 is little-endian itself.
  const auto put = [&text](const auto& value) { text.append(reinterpret_cast<const char*>(&value), sizeof value); };
  for (const Vec3& v : mesh.vertices)
    for (const double value : {v.x, v.y, v.z}) put(static_cast<float>(value));
  for (const Triangle& triangle : mesh.triangles) {
    put(static_cast<unsigned char>(3));
    for (const std::uint32_t corner : triangle) put(static_cast<std::int32_t>(corner));
  }
  return text;
}

}  // namespace relign::meshes
