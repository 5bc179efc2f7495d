// Meshes: PLY, STL and OBJ.
#include "meshes/mesh_file.h"
#include "target.h"

using namespace relign;

// assimp loses memory when it refuses a file.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libassimp"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes = fuzz::text_of(data, size);
  const char* ending = bytes.compare(0, 3, "ply") == 0                                   ? ".ply"
                       : bytes.compare(0, 1, "#") == 0 || bytes.compare(0, 2, "v ") == 0 ? ".obj"
                                                                                         : ".stl";
  const std::filesystem::path file = fuzz::scratch_folder() / ("mesh" + std::string(ending));
  fuzz::write_scratch(file, bytes);
  fuzz::accepted([&] {
    const meshes::Mesh mesh = meshes::read_mesh(file, meshes::Demand::body);
    for (const meshes::Triangle& triangle : mesh.triangles)
      for (const std::uint32_t corner : triangle) fuzz::demand(corner < mesh.vertices.size(), "corners that there are");
  });
  return 0;
}
