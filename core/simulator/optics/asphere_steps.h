// The arithmetic of one ray at a conic or polynomial face; see ray_steps.h. A plain conic needs conic_distance(), one
// newton_step() for the residual and refract_asphere(). Polynomials need more steps, and proofs that the hit is the
// first, which are written for blocks only (block_asphere.inc). face_shape.cpp searches the first hit in double.
#pragma once

#include "optics/ray_steps.h"

namespace relign::optics {

// In shape radii: a ray with a larger final residual misses the face.
constexpr float kMetRest = 1e-4F;
// Keep values finite beyond the shape radius, where results are discarded.
constexpr float kMaxQ = 1.5F, kMinRoot2 = 1e-3F;

// Where a ray is along its way to an asphere.
template <class Real>
struct AsphereStep {
  Real t;         // distance along the ray
  Real rest;      // distance from the face before the last step, along z
  Real approach;  // rate at which the ray approached the face there, along z
};

template <class Real>
struct AspherePlace {
  Real x, y, z;        // of the ray at its t
  Real height, slope;  // of the face there: the slope over r^2, twice
  Real root2;          // of the conic
};

// Position of a ray at t, with height and slope of the face there. Terms: number of even terms evaluated, of which the
// unused ones are 0. General: with odd terms, or even terms over the root.
template <int Terms, bool General, class Real>
RELIGN_DEVICE AspherePlace<Real> place_at(const OpOf<Real>& op, Real t, const RayOf<Real>& ray) {
  AspherePlace<Real> place;
  place.x = multiply_add(t, ray.lx, ray.x);
  place.y = multiply_add(t, ray.ly, ray.y);
  place.z = multiply_add(t, ray.lz, ray.z - op.vertex_z);
  const Real r2 = multiply_add(place.x, place.x, place.y * place.y);
  const Real kappa_c2 = op.conic_plus_1 * op.curvature * op.curvature;
  place.root2 = multiply_add(-kappa_c2, r2, Real{1});
  const Real root2 = larger(place.root2, Real{kMinRoot2});
  const Real root = square_root(root2);
  const Real q = smaller(r2 * op.per_shape_radius2, Real{kMaxQ});
  Real bump = Real{0}, bump_slope = Real{0};
  for (int k = Terms - 1; k >= 0; --k) {
    bump = multiply_add(bump, q, op.even[k]);
    bump_slope = multiply_add(bump_slope, q, static_cast<Real>(k + 1) * op.even[k]);
  }
  bump *= q;
  bump_slope *= op.per_shape_radius2;
  if (General) {
    if (op.over_root) {
      bump /= root;
      bump_slope = multiply_add(Real{0.5} * kappa_c2, bump / root2, bump_slope / root);
    }
    const Real root_q = square_root(q);
    Real odd = Real{0}, odd_slope = Real{0};
    for (int k = kOddTerms - 1; k >= 0; --k) {
      odd = multiply_add(odd, q, op.odd[k]);
      odd_slope = multiply_add(odd_slope, q, (static_cast<Real>(k) + Real{1.5}) * op.odd[k]);
    }
    bump = multiply_add(odd, q * root_q, bump);
    bump_slope = multiply_add(odd_slope, root_q * op.per_shape_radius2, bump_slope);
  }
  place.height = multiply_add(op.curvature, r2 / (Real{1} + root), bump);
  place.slope = multiply_add(Real{2}, bump_slope, op.curvature / root);
  return place;
}

// Distance to the conic c (x^2 + y^2 + kappa z^2) = 2 z: the face itself, or the conic near a polynomial.
template <class Real>
RELIGN_DEVICE Real conic_distance(const RayOf<Real>& ray, const OpOf<Real>& op) {
  const Real vertex = op.vertex_z + op.near_vertex, c = op.near_curvature, minus_c = -op.near_curvature;
  const Real kappa = op.near_conic_plus_1, k = op.near_conic_plus_1 - Real{1};
  const Real x = ray.x, y = ray.y, z = ray.z - vertex;
  const Real lx = ray.lx, ly = ray.ly, lz = ray.lz;
  const Real along = multiply_add(x, lx, multiply_add(y, ly, kappa * z * lz));
  const Real square = multiply_add(x, x, multiply_add(y, y, kappa * z * z));
  const Real a = c * multiply_add(k * lz, lz, Real{1});
  const Real b = multiply_add(minus_c, along, lz);
  const Real f = multiply_add(c, square, -Real{2} * z);
  const Real discriminant = multiply_add(b, b, -a * f);
  return f / (b - square_root(magnitude(discriminant)));
}

template <int Terms, bool General, class Real>
RELIGN_DEVICE void newton_step(const RayOf<Real>& ray, const OpOf<Real>& op, AsphereStep<Real>& step) {
  const AspherePlace<Real> place = place_at<Terms, General>(op, step.t, ray);
  step.rest = place.z - place.height;
  step.approach = multiply_add(-place.slope, multiply_add(place.x, ray.lx, place.y * ray.ly), ray.lz);
  step.t -= step.rest / step.approach;
}

// `rest`: of the last step, or huge for a ray that misses the face.
template <int Terms, bool General, bool Fresnel, class Real>
RELIGN_DEVICE void refract_asphere(RayOf<Real>& ray, const OpOf<Real>& op, Real t, Real rest) {
  const Real ratio = op.index_ratio;
  const Real minus_ratio2 = -ratio * ratio;
  const Real lx = ray.lx, ly = ray.ly, lz = ray.lz;
  const AspherePlace<Real> place = place_at<Terms, General>(op, t, ray);
  const Real x = place.x, y = place.y, slope = place.slope;
  const Real r2 = multiply_add(x, x, y * y);
  const Real length = square_root(multiply_add(slope * slope, r2, Real{1}));
  const Real nz = Real{1} / length;  // normal towards +z: (-slope x, -slope y, 1) / length
  const Real slanted = slope * nz;
  const Real cosine = multiply_add(slanted, multiply_add(x, lx, y * ly), -lz * nz);
  const Real refracted = multiply_add(minus_ratio2, multiply_add(-cosine, cosine, Real{1}), Real{1});
  const Real cosine_after = square_root(magnitude(refracted));
  const Real g = multiply_add(ratio, cosine, -cosine_after);
  const Real gs = -g * slanted;
  ray.x = x;
  ray.y = y;
  ray.z = place.z;
  ray.lx = multiply_add(ratio, lx, gs * x);
  ray.ly = multiply_add(ratio, ly, gs * y);
  ray.lz = multiply_add(ratio, lz, g * nz);
  const Real edge = multiply_add(-x, x, multiply_add(-y, y, op.clear_radius2));
  const Real near = kMetRest * op.shape_radius - magnitude(rest);
  ray.margin = smaller(smaller(smaller(ray.margin, near), smaller(edge, place.root2)), smaller(cosine, refracted));
  if (Fresnel) transmit(ray, op.index_after / op.index_before, cosine, cosine_after);
}

// All operations of an image path, for one ray. Faces with a polynomial are not among them: see above.
template <bool Fresnel, class Real>
RELIGN_DEVICE void trace_ray(RayOf<Real>& ray, const OpOf<Real>* ops, std::int32_t op_count) {
  int faces = 0;
  for (std::int32_t k = 0; k < op_count; ++k) {
    const OpOf<Real>& op = ops[k];
    if (Fresnel && (op.kind == Op::face || op.kind == Op::asphere) && ++faces > kFacesPerProduct) {
      divide_products(ray);
      faces = 1;
    }
    switch (op.kind) {
      case Op::frame:
        apply_frame(ray, op);
        break;
      case Op::shift:
        apply_shift(ray, op);
        break;
      case Op::face:
        intersect_face<Fresnel>(ray, op);
        break;
      case Op::asphere: {
        AsphereStep<Real> step = {conic_distance(ray, op), 0, 0};
        newton_step<0, false>(ray, op, step);
        refract_asphere<0, false, Fresnel>(ray, op, step.t, step.rest);
        break;
      }
      case Op::stop:
        intersect_stop(ray, op);
        break;
      case Op::bore:
        intersect_bore(ray, op);
        break;
    }
  }
}

}  // namespace relign::optics
