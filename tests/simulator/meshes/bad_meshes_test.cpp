// Which mesh files are accepted, and the errors for others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <limits>

#include "base/files.h"
#include "error_text.h"
#include "meshes/mesh_file.h"
#include "meshes/mesh_writer.h"
#include "optics/lens_under_test.h"

namespace relign::meshes {
namespace {

using test::error_text;
using testing::HasSubstr;

// A tetrahedron whose faces look outwards.
Mesh tetrahedron() {
  Mesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

class MeshFileTest : public testing::Test {
 protected:
  MeshFileTest() : folder_(std::filesystem::temp_directory_path() / ("relign-meshes-" + std::to_string(getpid()))) {}
  ~MeshFileTest() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& text) {
    write_file_atomically(folder_ / name, text);
    return folder_ / name;
  }
  std::string refusal(const std::string& name, const std::string& text, Demand demand = Demand::body) {
    const std::filesystem::path file = write(name, text);
    const std::string message = error_text(ErrorKind::bad_input, [&] { read_mesh(file, demand); });
    EXPECT_THAT(message, HasSubstr(file.string()));
    return message;
  }
  std::string refusal(const Mesh& mesh) { return refusal("L1.ply", ply_of(mesh)); }

  const std::filesystem::path folder_;
};

constexpr char kObj[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

std::string stl_text() {
  const Mesh mesh = tetrahedron();
  std::string text = "solid lens\n";
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    text += " facet normal 0 0 0\n  outer loop\n";
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3& v = mesh.corner(t, i);
      text += "   vertex " + std::to_string(v.x) + " " + std::to_string(v.y) + " " + std::to_string(v.z) + "\n";
    }
    text += "  endloop\n endfacet\n";
  }
  return text + "endsolid lens\n";
}

std::string stl_binary() {
  const Mesh mesh = tetrahedron();
  std::string bytes(80, ' ');
  const auto put = [&bytes](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  put(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int i = 0; i < 3; ++i) put(0.0F);
    for (std::size_t i = 0; i < 3; ++i)
      for (const double value : {mesh.corner(t, i).x, mesh.corner(t, i).y, mesh.corner(t, i).z})
        put(static_cast<float>(value));
    put(static_cast<std::uint16_t>(0));
  }
  return bytes;
}

TEST_F(MeshFileTest, EveryFormatGivesTheSameMesh) {
  for (const auto& [name, text] : {std::pair<std::string, std::string>{"a.ply", ply_of(tetrahedron())},
                                   {"A.PLY", ply_of(tetrahedron())},
                                   {"a.obj", kObj},
                                   {"b.stl", stl_text()},
                                   {"c.stl", stl_binary()}}) {
    const Mesh mesh = read_mesh(write(name, text), Demand::body);
    EXPECT_EQ(mesh.vertices.size(), 4u) << name << ": corners at one place are one vertex";
    EXPECT_EQ(mesh.triangles.size(), 4u) << name;
  }
}

TEST_F(MeshFileTest, SplitsPolygonsIntoTriangles) {
  const Mesh cube = read_mesh(write("cube.obj",
                                    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                                    "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"),
                              Demand::body);
  EXPECT_EQ(cube.triangles.size(), 12u);
  EXPECT_EQ(cube.face_number(11), 6u) << "positions are those of the file's faces";
}

TEST_F(MeshFileTest, ReportsHolesWithPosition) {
  Mesh open = tetrahedron();
  open.triangles.pop_back();
  EXPECT_THAT(refusal(open), HasSubstr("3 edges have a face on one side only: the mesh has holes; first: face 1, "
                                       "between (0, 1, 0) mm and (1, 0, 0) mm"));
}

TEST_F(MeshFileTest, ReportsFacesWithoutArea) {
  Mesh flat = tetrahedron();
  flat.vertices.push_back({0.5, 0.5, 0});
  flat.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 4, 3}, {4, 2, 3}, {1, 2, 4}};
  EXPECT_THAT(refusal(flat), HasSubstr("1 face has no area; first: face 6, at (1, 0, 0) mm"));
}

TEST_F(MeshFileTest, ReportsFlippedNormals) {
  Mesh one = tetrahedron();
  std::swap(one.triangles[2][0], one.triangles[2][1]);
  EXPECT_THAT(refusal(one), HasSubstr("3 edges are between faces that look to opposite sides: flipped normals; first: "
                                      "face 1, between"));
  Mesh all = tetrahedron();
  for (Triangle& triangle : all.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_THAT(refusal(all), HasSubstr("all faces look inwards (the volume is -0.1667 mm^3)"));
}

TEST_F(MeshFileTest, ReportsEdgesOfThreeFaces) {
  Mesh mesh = tetrahedron();
  mesh.vertices.push_back({1, 1, 1});
  mesh.triangles.push_back({0, 1, 4});
  EXPECT_THAT(refusal(mesh), HasSubstr("1 edge has more than two faces; first: face 1"));
}

TEST_F(MeshFileTest, ReportsNonFiniteNumbers) {
  Mesh mesh = tetrahedron();
  mesh.vertices[3].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(mesh), HasSubstr("3 faces have corners that are not finite; first: face 2, corner 3"));
  EXPECT_THAT(refusal("stop.ply", ply_of(mesh), Demand::surface), HasSubstr("not finite"))
      << "absorbing meshes need finite positions too";
}

TEST_F(MeshFileTest, AcceptsOpenAbsorbingMesh) {
  Mesh open = tetrahedron();
  open.triangles.pop_back();
  EXPECT_EQ(read_mesh(write("stop.ply", ply_of(open)), Demand::surface).triangles.size(), 3u);
}

TEST_F(MeshFileTest, RejectsEveryTruncation) {
  const std::string ply = ply_of(element_mesh(optics::relign_od().elements[2], 1.0));
  for (std::size_t size = 1; size < ply.size(); size += 97) {
    const std::string message = refusal("L3.ply", ply.substr(0, size));
    EXPECT_EQ(message.find("has holes"), std::string::npos) << "rejected before the mesh is checked, at " << size;
  }
  EXPECT_THAT(refusal("L3.ply", ply.substr(0, ply.size() - 1)), HasSubstr("truncated"));
  EXPECT_THAT(refusal("L3.stl", stl_binary().substr(0, 200)),
              HasSubstr("the file is truncated or not an STL: its header states 4 faces (284 bytes), found 200 bytes"));
  EXPECT_THAT(refusal("L3.stl", stl_text().substr(0, 250)), HasSubstr("truncated: the text STL has no 'endsolid'"));
  EXPECT_THAT(refusal("L3.obj", std::string(kObj).substr(0, sizeof kObj - 9)), HasSubstr("holes"))
      << "the text of an OBJ file does not state its length";
}

TEST_F(MeshFileTest, RejectsOtherFiles) {
  EXPECT_THAT(refusal("L1.json", "{}"), HasSubstr("unknown mesh format '.json'; allowed: .ply, .stl, .obj"));
  EXPECT_THAT(refusal("L1.ply", "what is this"), HasSubstr("does not begin with 'ply'"));
  EXPECT_THAT(refusal("L1.stl", "what is this"), HasSubstr("not an STL file"));
  EXPECT_THAT(refusal("L1.obj", ""), HasSubstr("the file is empty"));
  EXPECT_THAT(refusal("L1.obj", "v 0 0 0\n"), HasSubstr(".obj"));
  EXPECT_THAT(refusal("L1.ply", "ply\nformat ascii 1.0\nelement vertex 0\nelement face 0\nend_header\n"),
              HasSubstr(".ply"));
  EXPECT_THAT(
      refusal("L1.ply",
              "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
              "property float z\nelement face 4000000000\nproperty list uchar int vertex_indices\nend_header\n"),
      HasSubstr("truncated: its header states 3 vertices and 4000000000 faces, but only 0 bytes follow"));
  EXPECT_THAT(error_text(ErrorKind::io, [&] { read_mesh(folder_ / "none.ply", Demand::body); }), HasSubstr("none.ply"));
}

// assimp would run out of memory, or never return.
TEST_F(MeshFileTest, RejectsTextThatContradictsItsHeader) {
  const auto ply = [](const std::string& format, const std::string& faces, const std::string& list) {
    return "ply\nformat " + format + " 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n" +
           "element face " + faces + "\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n" +
           list + "\n";
  };
  EXPECT_THAT(refusal("L1.ply", ply("ascii", "1", "2222222222 0 1 2")),
              HasSubstr("fewer values than the list states in entry 0 of element 'face': '2222222222 0 1 2'"));
  EXPECT_THAT(refusal("L1.ply", ply("ascii", "1", "4 0 1 2")), HasSubstr("fewer values than the list states"));
  EXPECT_THAT(refusal("L1.ply", ply("ascii", "1", "3 0 1 2 7")), HasSubstr("more values than the header states"));
  EXPECT_THAT(refusal("L1.ply", ply("ascii", "1", "\n3 0 1 2")), HasSubstr("fewer values than the header states"));
  for (const std::string message : {"22222222222222222222222222222222", "3e9", "-3", "three"})
    EXPECT_THAT(refusal("L1.ply", ply("ascii", "1", message + " 0 1 2")),
                HasSubstr("expected the number of values of a list"));
  EXPECT_THAT(refusal("L1.ply", ply("ascii", "1e999", "3 0 1 2")), HasSubstr("expected a number of entries"));
  EXPECT_THAT(refusal("L1.ply", ply(std::string("ascii\0", 6), "1", "3 0 1 2")),
              HasSubstr("allowed: ascii, binary_little_endian, binary_big_endian"));
}

TEST_F(MeshFileTest, ReportsIndicesOutOfRange) {
  Mesh mesh = tetrahedron();
  mesh.triangles[3][2] = 17;
  EXPECT_THAT(refusal(mesh), HasSubstr("L1.ply"));
}

}  // namespace
}  // namespace relign::meshes
