// A surface made of triangles. Lengths in mm; the corners of a face are seen counter-clockwise from outside.
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
  // Of each triangle: the number of the face it comes from in its file, from 1. Empty: the triangle's own number.
  std::vector<std::uint32_t> faces;

  std::size_t face_number(std::size_t triangle) const { return faces.empty() ? triangle + 1 : faces[triangle]; }
  const Vec3& corner(std::size_t triangle, std::size_t which) const { return vertices[triangles[triangle][which]]; }
  // Twice the area long, outwards.
  Vec3 normal(std::size_t triangle) const {
    const Vec3& a = corner(triangle, 0);
    return cross(corner(triangle, 1) - a, corner(triangle, 2) - a);
  }
};

// Where the z axis meets a triangle; nothing if it passes beside it.
std::optional<double> height_on_axis(const Mesh& mesh, std::size_t triangle);

// Corners at the same place become one vertex; vertices without a triangle are left out.
Mesh welded(const Mesh& mesh);

// An edge as a triangle has it: from the vertex at `corner` to the next.
struct HalfEdge {
  std::uint32_t low = 0, high = 0;  // its vertices
  std::uint32_t triangle = 0;
  std::uint8_t corner = 0;
  bool rising = false;  // from low to high
};
// All of them, those of one edge side by side.
std::vector<HalfEdge> sorted_edges(const Mesh& mesh);

}  // namespace relign::meshes
