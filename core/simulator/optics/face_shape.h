// The shape of one face, in double, with its vertex as origin: a sphere, plane or conic and polynomials on top,
//
//   z(r) = c r^2 / (1 + s) + a2 r^2 + a3 r^3 + a4 r^4 + ... + (b2 r^2 + b4 r^4 + ...) / s,   s = sqrt(1 - (1 + k) c^2
//   r^2)
//
// Everything that traces single rays meets faces here; blocks of rays do the same in float (block_kernels.cpp) and
// come here for rays that few steps do not settle.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "optics/face_rings.h"
#include "optics/prescription.h"
#include "optics/rigid.h"

namespace relign::optics {

// Height of the face above its vertex plane at a distance from the axis; not a number where the conic has ended.
double sag(const Face& face, double radius);
double slope(const Face& face, double radius);  // dz/dr

struct FacePoint {
  Vec3 at;
  Vec3 normal;  // unit, towards +z
};

// What a polynomial face is known to keep within a distance from the axis.
struct FaceBounds {
  double radius = 0;               // mm
  double lowest = 0, highest = 0;  // sag, mm
  double steepest = 0;             // |dz/dr|
  double most_bent = 0;            // second derivative of the sag in any direction, 1/mm
  // A conic near the face, where Newton's steps may begin: its vertex, curvature and 1 + k. Of the face's own conic and
  // a paraboloid through the polynomial, the nearer one.
  double near_vertex = 0, near_curvature = 0, near_conic_plus_1 = 1;
  std::shared_ptr<const FaceRings> rings;  // null for a conic
};
FaceBounds bounds_of(const Face& face, double radius);
// How far beyond its clear radii a polynomial still describes a face: up to where it grows steeper than any lens, or
// twice the clear radius where that is known.
double sound_radius(const Face& face);

// Where a ray from p along l (unit, either way) first passes through the sheet of the face that holds the vertex,
// forwards as the ray goes and anywhere on its line; empty when it misses. Of a polynomial face only the part within
// `bounds.radius` counts: every crossing there is found, however wild the polynomial is outside. Conics are met in
// closed form; their clear radii are not looked at.
std::optional<FacePoint> meet(const Face& face, const FaceBounds& bounds, const Vec3& p, const Vec3& l);

// Polynomials of Forbes (Optics Express 15, 5218 (2007)) in powers of r. `radius`: where u = r / radius is 1.
// Strong aspheres: u^4 sum a_m Q_m(u^2), Q_m the Jacobi polynomials P_m^(0,4)(2 u^2 - 1); returns a4, a6, ...
std::vector<double> even_terms_of_q_con(const std::vector<double>& coefficients, double radius);
// Mild aspheres: u^2 (1 - u^2) / s sum a_m Q_m(u^2), of unit slope; returns b2, b4, ...
std::vector<double> over_root_terms_of_q_bfs(const std::vector<double>& coefficients, double radius);
// On a conic the departure is measured along the conic's normal (Forbes, Optics Express 19, 9923 (2011)), which
// multiplies the sum over s by sqrt(1 - k c^2 r^2). Returns b2, b4, ... of a polynomial that keeps within 1e-6 mm of
// that product up to `reach` mm from the axis; nothing where the terms up to r^32 do not come so near.
std::optional<std::vector<double>> over_root_terms_on_conic(const std::vector<double>& over_root, double curvature,
                                                            double conic, double reach);

}  // namespace relign::optics
