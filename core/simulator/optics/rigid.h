// Motions by angles and shifts; lengths in mm.
#pragma once

#include <vector>

#include "optics/elementary.h"
#include "optics/motion.h"

namespace relign::optics {

// Rx(rx) * Ry(ry) * Rz(rz), right-handed, degrees.
inline Rotation rotation_of_degrees(double rx, double ry, double rz = 0) {
  const SineCosine a = sine_cosine_of_degrees(rx), b = sine_cosine_of_degrees(ry), c = sine_cosine_of_degrees(rz);
  const Rotation around_x = {1, 0, 0, 0, a.cosine, -a.sine, 0, a.sine, a.cosine};
  const Rotation around_y = {b.cosine, 0, b.sine, 0, 1, 0, -b.sine, 0, b.cosine};
  const Rotation around_z = {c.cosine, -c.sine, 0, c.sine, c.cosine, 0, 0, 0, 1};
  return product(product(around_x, around_y), around_z);
}

// p_outer = pivot + Rx Ry (p_inner - pivot) + shift, tilt = {rx, ry} in degrees.
inline Motion about(const Vec3& pivot, const std::vector<double>& tilt_deg, const Vec3& shift) {
  Motion motion;
  if (tilt_deg[0] != 0 || tilt_deg[1] != 0) motion.rotation = rotation_of_degrees(tilt_deg[0], tilt_deg[1]);
  motion.translation = pivot - turn(motion.rotation, pivot) + shift;
  return motion;
}

}  // namespace relign::optics
