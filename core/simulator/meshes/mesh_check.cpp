#include "meshes/mesh_check.h"

#include <cstdio>

#include "base/error.h"
#include "base/own_command.h"
#include "base/text.h"

namespace relign::meshes {
namespace {

// Ratio of height to longest edge below which a face has no area: above the float rounding of faces of 0.01 mm, 20 mm
// from the origin.
constexpr double kFlat = 1e-4;

std::string place(const Vec3& v) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.6g, %.6g, %.6g) mm", v.x, v.y, v.z);
  return text;
}

// Mistakes of one kind: their number, and the position of the first.
class Mistakes {
 public:
  void add(const Mesh& mesh, std::size_t triangle, const std::string& detail) {
    if (count_++ == 0 || mesh.face_number(triangle) < face_) {
      face_ = mesh.face_number(triangle);
      detail_ = detail;
    }
  }
  void report(const std::string& one, const std::string& several, std::vector<Problem>& problems,
              const std::string& file) const {
    if (count_ == 0) return;
    const std::string what = count_ == 1 ? one : std::to_string(count_) + " " + several;
    problems.push_back({file, 0, 0, "", what + "; first: face " + std::to_string(face_) + ", " + detail_});
  }

 private:
  std::size_t count_ = 0, face_ = 0;
  std::string detail_;
};

std::string edge_place(const Mesh& mesh, const HalfEdge& edge) {
  return "between " + place(mesh.vertices[edge.low]) + " and " + place(mesh.vertices[edge.high]);
}

bool is_flat(const Mesh& mesh, std::size_t triangle) {
  double longest2 = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 edge = mesh.corner(triangle, (i + 1) % 3) - mesh.corner(triangle, i);
    longest2 = std::max(longest2, dot(edge, edge));
  }
  return length(mesh.normal(triangle)) <= kFlat * longest2;
}

void check_edges(const Mesh& mesh, const std::string& file, std::vector<Problem>& problems) {
  Mistakes open, crowded, turned;
  const std::vector<HalfEdge> edges = sorted_edges(mesh);
  for (std::size_t from = 0; from < edges.size();) {
    std::size_t to = from + 1;
    while (to < edges.size() && edges[to].low == edges[from].low && edges[to].high == edges[from].high) ++to;
    const HalfEdge& edge = edges[from];
    if (to - from == 1)
      open.add(mesh, edge.triangle, edge_place(mesh, edge));
    else if (to - from > 2)
      crowded.add(mesh, edge.triangle, edge_place(mesh, edge));
    else if (edge.rising == edges[from + 1].rising)
      turned.add(
          mesh, edge.triangle,
          edge_place(mesh, edge) + ", against face " + std::to_string(mesh.face_number(edges[from + 1].triangle)));
    from = to;
  }
  open.report("1 edge has a face on one side only: the mesh has a hole",
              "edges have a face on one side only: the mesh has holes", problems, file);
  crowded.report("1 edge has more than two faces", "edges have more than two faces", problems, file);
  turned.report("1 edge is between faces that look to opposite sides: flipped normals",
                "edges are between faces that look to opposite sides: flipped normals", problems, file);
}

double volume(const Mesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    sum += dot(mesh.corner(t, 0), cross(mesh.corner(t, 1), mesh.corner(t, 2)));
  return sum / 6;
}

}  // namespace

void check_mesh(const Mesh& mesh, Demand demand, const std::string& file) {
  std::vector<Problem> problems;
  if (mesh.triangles.empty()) throw_if_any({{file, 0, 0, "", "expected a mesh of triangles, found no faces"}});
  Mistakes infinite, flat;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    bool finite = true;
    for (std::size_t i = 0; i < 3 && finite; ++i) {
      const Vec3& v = mesh.corner(t, i);
      finite = std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
      if (!finite) infinite.add(mesh, t, "corner " + std::to_string(i + 1));
    }
    if (finite && demand == Demand::body && is_flat(mesh, t)) flat.add(mesh, t, "at " + place(mesh.corner(t, 0)));
  }
  infinite.report("1 face has a corner that is not finite", "faces have corners that are not finite", problems, file);
  flat.report("1 face has no area", "faces have no area", problems, file);
  if (demand == Demand::body && problems.empty()) {
    check_edges(mesh, file, problems);
    if (const double inside = volume(mesh); problems.empty() && inside <= 0)
      problems.push_back({file, 0, 0, "",
                          "all faces look inwards (the volume is " + significant(inside, 4) +
                              " mm^3): flipped normals; reverse the order of every face's corners"});
  }
  if (problems.empty()) return;
  if (demand == Demand::body)
    problems.push_back(
        {file, 0, 0, "",
         "a lens mesh must be one closed surface whose faces look outwards; repair it where it was made, or "
         "create one with '" +
             own_command("lens export-mesh") + "'"});
  throw_if_any(problems);
}

}  // namespace relign::meshes
