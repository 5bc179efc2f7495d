#include "meshes/mesh_file.h"

#include <algorithm>
#include <cctype>
#include <stdexcept>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"
#include "meshes/mesh_header.h"
#include "meshes/mesh_import.h"
#include "relign/optional_part.hpp"

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

// Throws Error(bad_input) if this installation cannot read meshes.
bool import_mesh(const fs::path& file, MeshReceiver& receiver) {
  using Import = bool(const char* file, MeshReceiver& receiver);
  static Import* import = nullptr;
  if (!import) try {
      import = function_of_part<Import>("mesh_import", "relign_import_mesh");
    } catch (const std::runtime_error& error) {
      throw Error(ErrorKind::bad_input, file.string() + ": reading a mesh needs assimp: " + error.what());
    }
  return import(file.c_str(), receiver);
}

// Collects what the file has. A mesh in several pieces counts its faces through; corners are numbers within a piece.
class Collector : public MeshReceiver {
 public:
  Collector(const fs::path& file, Mesh& mesh) : file_(file), mesh_(mesh) {}
  std::uint64_t faces() const { return faces_; }

  void piece(std::size_t vertices) override {
    base_ = mesh_.vertices.size();
    vertices_ = vertices;
  }
  void vertex(double x, double y, double z) override { mesh_.vertices.push_back({x, y, z}); }
  void face(const unsigned* corners, unsigned count) override {
    ++faces_;
    if (count < 3)
      reject_mesh(file_, "face " + std::to_string(faces_) + " has " + std::to_string(count) +
                             " corners; expected three or more");
    for (unsigned i = 0; i < count; ++i)
      if (corners[i] >= vertices_)
        reject_mesh(file_, "face " + std::to_string(faces_) + " refers to vertex " + std::to_string(corners[i]) +
                               "; the mesh has " + std::to_string(vertices_));
    for (unsigned i = 2; i < count; ++i) {
      const auto at = [&](unsigned corner) { return static_cast<std::uint32_t>(base_ + corners[corner]); };
      mesh_.triangles.push_back({at(0), at(i - 1), at(i)});
      mesh_.faces.push_back(static_cast<std::uint32_t>(faces_));
    }
  }

 private:
  const fs::path& file_;
  Mesh& mesh_;
  std::size_t base_ = 0, vertices_ = 0;
  std::uint64_t faces_ = 0;
};

}  // namespace

Mesh read_mesh(const fs::path& file, Demand demand) {
  const HeaderCounts header = check_header(file);
  Mesh mesh;
  Collector found(file, mesh);
  if (!import_mesh(file, found))
    reject_mesh(file, "the file is damaged, or not a mesh of the format that its name states");
  if (header.faces && found.faces() != *header.faces)
    reject_mesh(file, "the file is truncated: its header states " + counted(*header.faces, "face") + ", found " +
                          std::to_string(found.faces()));
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
