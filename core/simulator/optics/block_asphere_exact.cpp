// The slow path of block_asphere.inc: one ray, in double, compiled once for all instruction sets, so that all of them
// give the same bits.
#include <algorithm>
#include <cmath>

#include "optics/first_rise.h"
#include "optics/ray_block.h"
#include "optics/rigid.h"

namespace relign::optics {
namespace {

// Sag at r^2, and its derivative with respect to r^2: the formulas of face_shape.h, with polynomials in q.
double height(const Op& op, double r2, double& slope) {
  const auto of = [](float value) { return static_cast<double>(value); };
  const double c = of(op.curvature), kappa_c2 = of(op.conic_plus_1) * c * c;
  constexpr double kMinRoot2 = 1e-3;  // as in block_asphere.inc
  const double root2 = std::max(1 - kappa_c2 * r2, kMinRoot2), root = std::sqrt(root2);
  const double per_radius2 = of(op.per_shape_radius2), q = r2 * per_radius2;
  double even = 0, even_slope = 0;
  for (int k = op.even_terms - 1; k >= 0; --k) {
    even = even * q + of(op.even[k]);
    even_slope = even_slope * q + (k + 1) * of(op.even[k]);
  }
  even *= q;
  even_slope *= per_radius2;
  if (op.over_root) {
    even /= root;
    even_slope = even_slope / root + 0.5 * kappa_c2 * even / root2;
  }
  double odd = 0, odd_slope = 0;
  for (int k = op.odd_terms - 1; k >= 0; --k) {
    odd = odd * q + of(op.odd[k]);
    odd_slope = odd_slope * q + (k + 1.5) * of(op.odd[k]);
  }
  const double root_q = std::sqrt(q);
  slope = c / (2 * root) + even_slope + odd_slope * root_q * per_radius2;
  return c * r2 / (1 + root) + even + odd * q * root_q;
}

}  // namespace

bool intersect_asphere_exactly(const Op& op, const float (&p)[3], const float (&l)[3], float& t, std::uint64_t& steps) {
  const double x = static_cast<double>(p[0]), y = static_cast<double>(p[1]), z = static_cast<double>(p[2]);
  const double lx = static_cast<double>(l[0]), ly = static_cast<double>(l[1]), lz = static_cast<double>(l[2]);
  const double radius = static_cast<double>(op.shape_radius);
  // The part of the line within the shape radius and between the lowest and the highest point of the face.
  const double across = lx * lx + ly * ly, along = x * lx + y * ly, beside = radius * radius - x * x - y * y;
  double low = -1e30, high = 1e30;
  if (across > 0) {
    const double discriminant = along * along + across * beside;
    if (!(discriminant >= 0)) return false;
    const double root = std::sqrt(discriminant);
    low = (-along - root) / across;
    high = (-along + root) / across;
  } else if (!(beside >= 0)) {
    return false;
  }
  if (!(lz < 0)) return false;  // towards -z, as all rays of blocks travel
  const double slack = 1e-6 * radius;
  low = std::max(low, (static_cast<double>(op.highest) + slack - z) / lz);
  high = std::min(high, (static_cast<double>(op.lowest) - slack - z) / lz);
  if (!(low <= high)) return false;
  const auto before = [&](double way, double& derivative) {  // how far before the face
    const double at_x = x + way * lx, at_y = y + way * ly;
    ++steps;
    double slope = 0;
    const double sag = height(op, at_x * at_x + at_y * at_y, slope);
    derivative = 2 * slope * (at_x * lx + at_y * ly) - lz;
    return sag - (z + way * lz);
  };
  const Vec3 from{x, y, z}, along_ray{lx, ly, lz};
  constexpr double kRoundingOfFloat = 1e-9;
  const auto found =
      first_rise_over_rings(before, RayOverFace(from, along_ray), *op.rings, radius, low, high, kRoundingOfFloat);
  if (!found) return false;
  t = static_cast<float>(*found);
  return true;
}

}  // namespace relign::optics
