// Vectors and rigid motions in double; lengths in mm. NVRTC compiles this header.
#pragma once

#include <array>
#include <cmath>

namespace relign::optics {

struct Vec3 {
  double x = 0, y = 0, z = 0;
};

inline Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator*(double s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 unit(const Vec3& a) { return (1 / std::sqrt(dot(a, a))) * a; }

// Row-major rotation.
using Rotation = std::array<double, 9>;

inline constexpr Rotation kIdentityRotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};

inline Vec3 turn(const Rotation& r, const Vec3& v) {
  return {r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
          r[6] * v.x + r[7] * v.y + r[8] * v.z};
}

inline Rotation transposed(const Rotation& r) { return {r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]}; }

inline Rotation product(const Rotation& a, const Rotation& b) {
  Rotation c{};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      for (int k = 0; k < 3; ++k) c[3 * row + column] += a[3 * row + k] * b[3 * k + column];
  return c;
}

// p_outer = rotation * p_inner + translation.
struct Motion {
  Rotation rotation = kIdentityRotation;
  Vec3 translation;

  Vec3 point(const Vec3& inner) const { return turn(rotation, inner) + translation; }
  Vec3 direction(const Vec3& inner) const { return turn(rotation, inner); }
  bool is_shift() const { return rotation == kIdentityRotation; }
  bool is_identity() const { return is_shift() && translation.x == 0 && translation.y == 0 && translation.z == 0; }
};

inline Motion inverse(const Motion& motion) {
  const Rotation back = transposed(motion.rotation);
  return {back, -1.0 * turn(back, motion.translation)};
}

// First `inner`, then `outer`.
inline Motion after(const Motion& outer, const Motion& inner) {
  return {product(outer.rotation, inner.rotation), outer.point(inner.translation)};
}

}  // namespace relign::optics
