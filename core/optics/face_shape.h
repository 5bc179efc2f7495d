// The shape of one face, in double, with its vertex as origin: a sphere, plane or conic and an even polynomial
// on top, z(r) = c r^2 / (1 + sqrt(1 - (1 + k) c^2 r^2)) + a4 r^4 + a6 r^6 + ...
//
// Everything that traces single rays meets faces here; blocks of rays do the same in float (block_kernels.cpp).
#pragma once

#include <optional>

#include "optics/prescription.h"
#include "optics/rigid.h"

namespace relign::optics {

// Height of the face above its vertex plane at a distance from the axis; not a number where the conic has ended.
double sag(const Face& face, double radius);

struct FacePoint {
  Vec3 at;
  Vec3 normal;  // unit, towards +z
};

// Where a ray from p along l (unit, either way) meets the sheet of the face that holds the vertex; empty when it
// misses. Clear radii are not looked at.
std::optional<FacePoint> meet(const Face& face, const Vec3& p, const Vec3& l);

}  // namespace relign::optics
