// A surface made of triangles. Lengths in mm; corners of a face are counter-clockwise seen from outside.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "optics/rigid.h"

namespace relign::meshes {

using optics::Vec3;

inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const Vec3& a) { return std::sqrt(dot(a, a)); }

using Triangle = std::array<std::uint32_t, 3>;

struct Mesh {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
  // Per triangle: the number of its face in the file, from 1. Empty: the triangle's own number.
  std::vector<std::uint32_t> faces;

  std::size_t face_number(std::size_t triangle) const { return faces.empty() ? triangle + 1 : faces[triangle]; }
  const Vec3& corner(std::size_t triangle, std::size_t which) const { return vertices[triangles[triangle][which]]; }
  // Outward normal; its length is twice the area.
  Vec3 normal(std::size_t triangle) const {
    const Vec3& a = corner(triangle, 0);
    return cross(corner(triangle, 1) - a, corner(triangle, 2) - a);
  }
};

// z of the intersection of the z axis and a triangle; empty if it misses.
std::optional<double> height_on_axis(const Mesh& mesh, std::size_t triangle);

// Merges vertices at the same position and drops those without a triangle.
Mesh welded(const Mesh& mesh);

// An edge of one triangle: from the vertex at `corner` to the next.
struct HalfEdge {
  std::uint32_t low = 0, high = 0;  // its vertices
  std::uint32_t triangle = 0;
  std::uint8_t corner = 0;
  bool rising = false;  // from low to high
};
// All half edges; those of the same edge are adjacent.
std::vector<HalfEdge> sorted_edges(const Mesh& mesh);

}  // namespace relign::meshes
