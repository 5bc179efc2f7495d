#include "meshes/mesh.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace relign::meshes {

Mesh welded(const Mesh& mesh) {
  const std::size_t count = mesh.vertices.size();
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&](std::uint32_t i) {
    const Vec3& v = mesh.vertices[i];
    return std::make_tuple(v.x, v.y, v.z);
  };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return std::make_tuple(key(a), a) < std::make_tuple(key(b), b); });
  // Of each vertex: the first of those at its place.
  std::vector<std::uint32_t> first(count);
  for (std::size_t i = 0; i < count; ++i)
    first[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? first[order[i - 1]] : order[i];

  Mesh result;
  result.triangles = mesh.triangles;
  result.faces = mesh.faces;
  constexpr std::uint32_t kUnused = 0xffffffffU;
  std::vector<std::uint32_t> place(count, kUnused);
  for (Triangle& triangle : result.triangles)
    for (std::uint32_t& corner : triangle) {
      std::uint32_t& at = place[first[corner]];
      if (at == kUnused) {
        at = static_cast<std::uint32_t>(result.vertices.size());
        result.vertices.push_back(mesh.vertices[corner]);
      }
      corner = at;
    }
  return result;
}

std::vector<HalfEdge> sorted_edges(const Mesh& mesh) {
  std::vector<HalfEdge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::uint8_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t from = mesh.triangles[t][corner], to = mesh.triangles[t][(corner + 1U) % 3];
      edges.push_back({std::min(from, to), std::max(from, to), static_cast<std::uint32_t>(t), corner, from < to});
    }
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.low, a.high, a.triangle, a.corner) < std::tie(b.low, b.high, b.triangle, b.corner);
  });
  return edges;
}

std::optional<double> height_on_axis(const Mesh& mesh, std::size_t triangle) {
  const Vec3 &a = mesh.corner(triangle, 0), &b = mesh.corner(triangle, 1), &c = mesh.corner(triangle, 2);
  const double wa = b.x * c.y - b.y * c.x, wb = c.x * a.y - c.y * a.x, wc = a.x * b.y - a.y * b.x;
  const double sum = wa + wb + wc;
  const bool inside = (wa >= 0 && wb >= 0 && wc >= 0) || (wa <= 0 && wb <= 0 && wc <= 0);
  if (!inside || sum == 0) return std::nullopt;
  return (wa * a.z + wb * b.z + wc * c.z) / sum;
}

}  // namespace relign::meshes
