// The shape of one face, in double, with its vertex as origin: a sphere, plane or conic and polynomials on top,
//
//   z(r) = c r^2 / (1 + s) + a2 r^2 + a3 r^3 + a4 r^4 + ... + (b2 r^2 + b4 r^4 + ...) / s,
//   s = sqrt(1 - (1 + k) c^2 r^2)
//
// Single rays are intersected with faces here; block_kernels.cpp does the same for blocks in float, and in double where
// a few Newton steps prove nothing.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "optics/face_rings.h"
#include "optics/prescription.h"
#include "optics/rigid.h"

namespace relign::optics {

// Height of the face above its vertex plane at a distance from the axis, mm; NaN beyond the end of the conic.
double sag(const Face& face, double radius);
double slope(const Face& face, double radius);  // dz/dr

struct FacePoint {
  Vec3 at;
  Vec3 normal;  // unit, towards +z
};

// Bounds of a polynomial face within a distance from the axis.
struct FaceBounds {
  double radius = 0;               // mm
  double lowest = 0, highest = 0;  // sag, mm
  double steepest = 0;             // |dz/dr|
  double most_bent = 0;            // second derivative of the sag in any direction, 1/mm
  // A conic near the face from which Newton's iteration starts (vertex, curvature, 1 + k): the face's own conic or a
  // fitted paraboloid, whichever is closer.
  double near_vertex = 0, near_curvature = 0, near_conic_plus_1 = 1;
  std::shared_ptr<const FaceRings> rings;  // null for a conic
};
FaceBounds bounds_of(const Face& face, double radius);
// Radius up to which a polynomial still describes a face, mm: from the semi-diameter to where the face becomes steeper
// than any lens, at most twice a known semi-diameter.
double valid_radius(const Face& face);

// First intersection of a ray from p along l (unit, either direction) with the sheet of the face that contains the
// vertex, anywhere on its line; empty on a miss. Of a polynomial face only the part within `bounds.radius` counts:
// every crossing there is found, whatever the polynomial does outside. Conics are solved in closed form, regardless of
// their semi-diameters.
std::optional<FacePoint> intersect(const Face& face, const FaceBounds& bounds, const Vec3& p, const Vec3& l);

// Polynomials of Forbes (Optics Express 15, 5218 (2007)) in powers of r. `radius`: where u = r / radius is 1.
// Strong aspheres: u^4 sum a_m Q_m(u^2), Q_m the Jacobi polynomials P_m^(0,4)(2 u^2 - 1); returns a4, a6, ...
std::vector<double> even_terms_of_q_con(const std::vector<double>& coefficients, double radius);
// Mild aspheres: u^2 (1 - u^2) / s sum a_m Q_m(u^2), of unit slope; returns b2, b4, ...
std::vector<double> over_root_terms_of_q_bfs(const std::vector<double>& coefficients, double radius);
// On a conic the departure is measured along the conic's normal (Forbes, Optics Express 19, 9923 (2011)), which
// multiplies the sum over s by sqrt(1 - k c^2 r^2). Returns b2, b4, ... of a polynomial within 1e-6 mm of that product
// up to `reach` mm from the axis; empty if terms up to r^32 do not suffice.
std::optional<std::vector<double>> over_root_terms_on_conic(const std::vector<double>& over_root, double curvature,
                                                            double conic, double reach);

}  // namespace relign::optics
