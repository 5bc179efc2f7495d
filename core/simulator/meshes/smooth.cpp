#include "meshes/smooth.h"

#include <numeric>

namespace relign::meshes {
namespace {

// Union-find.
class Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0U); }
  std::uint32_t of(std::uint32_t item) {
    while (parent_[item] != item) item = parent_[item] = parent_[parent_[item]];
    return item;
  }
  // The smaller number represents both, so that results do not depend on the order of calls.
  void unite(std::uint32_t a, std::uint32_t b) {
    a = of(a);
    b = of(b);
    (a < b ? parent_[b] : parent_[a]) = a < b ? a : b;
  }
  // Numbers from 0 in the order in which the sets first appear.
  std::vector<std::uint32_t> numbered(std::uint32_t& count) {
    std::vector<std::uint32_t> number(parent_.size());
    count = 0;
    for (std::uint32_t i = 0; i < parent_.size(); ++i) number[i] = of(i) == i ? count++ : number[of(i)];
    return number;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

// Per triangle: whether it belongs to a flat rim.
std::vector<char> flat_rims(const Mesh& mesh, const std::vector<HalfEdge>& edges) {
  std::vector<char> flat(mesh.triangles.size());
  for (std::size_t t = 0; t < flat.size(); ++t) {
    const Vec3 normal = mesh.normal(t);
    flat[t] = std::hypot(normal.x, normal.y) < kFlatRimRadians * std::fabs(normal.z);
  }
  Sets sets(flat.size());
  for (std::size_t i = 0; i + 1 < edges.size(); i += 2)
    if (flat[edges[i].triangle] && flat[edges[i + 1].triangle]) sets.unite(edges[i].triangle, edges[i + 1].triangle);
  std::vector<char> on_axis(flat.size(), 0);
  for (std::uint32_t t = 0; t < flat.size(); ++t)
    if (flat[t] && height_on_axis(mesh, t)) on_axis[sets.of(t)] = 1;
  for (std::uint32_t t = 0; t < flat.size(); ++t) flat[t] = flat[t] && !on_axis[sets.of(t)];
  return flat;
}

// body(first, second) for the two halves of every edge whose faces meet smoothly.
template <class Body>
void for_smooth_edges(const Mesh& mesh, const Body& body) {
  const double least_cosine = optics::sine_cosine_of_degrees(kCreaseDegrees).cosine;
  const std::vector<HalfEdge> edges = sorted_edges(mesh);
  const std::vector<char> rim = flat_rims(mesh, edges);
  for (std::size_t i = 0; i + 1 < edges.size(); i += 2) {
    if (rim[edges[i].triangle] != rim[edges[i + 1].triangle]) continue;
    const Vec3 a = mesh.normal(edges[i].triangle), b = mesh.normal(edges[i + 1].triangle);
    if (dot(a, b) >= least_cosine * length(a) * length(b)) body(edges[i], edges[i + 1]);
  }
}

std::uint32_t corner_of(const HalfEdge& edge, bool low) {
  // The edge begins at `corner` with its low vertex if it rises.
  return 3 * edge.triangle + (edge.rising == low ? edge.corner : (edge.corner + 1U) % 3);
}

}  // namespace

CornerNormals corner_normals(const Mesh& mesh) {
  Sets sets(3 * mesh.triangles.size());
  for_smooth_edges(mesh, [&](const HalfEdge& a, const HalfEdge& b) {
    for (const bool low : {true, false}) sets.unite(corner_of(a, low), corner_of(b, low));
  });
  std::uint32_t count = 0;
  const std::vector<std::uint32_t> number = sets.numbered(count);
  CornerNormals result;
  result.normals.resize(count);
  result.corners.resize(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i) {
      result.corners[t][i] = number[3 * t + i];
      // Max's weights: the sum over the faces of a vertex is exact if the vertex and its neighbours are on a sphere.
      const Vec3 a = mesh.corner(t, (i + 1) % 3) - mesh.corner(t, i);
      const Vec3 b = mesh.corner(t, (i + 2) % 3) - mesh.corner(t, i);
      Vec3& sum = result.normals[number[3 * t + i]];
      sum = sum + (1 / (dot(a, a) * dot(b, b))) * cross(a, b);
    }
  for (Vec3& normal : result.normals) normal = unit(normal);
  return result;
}

Patches smooth_patches(const Mesh& mesh) {
  Sets sets(mesh.triangles.size());
  for_smooth_edges(mesh, [&](const HalfEdge& a, const HalfEdge& b) { sets.unite(a.triangle, b.triangle); });
  Patches patches;
  patches.of_triangle = sets.numbered(patches.count);
  return patches;
}

}  // namespace relign::meshes
