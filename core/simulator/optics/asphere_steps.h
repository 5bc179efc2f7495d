// The arithmetic of one ray at a conic or polynomial face; see ray_steps.h. A plain conic needs conic_distance(), one
// newton_step() for the residual and refract_asphere(). Polynomials need more steps, and proofs that the hit is the
// first, which are written for blocks only (block_asphere.inc). face_shape.cpp does the same in double.
#pragma once

#include "optics/ray_steps.h"

namespace relign::optics {

// In shape radii: a ray with a larger final residual misses the face.
constexpr float kMetRest = 1e-4F;
// Keep values finite beyond the shape radius, where results are discarded.
constexpr float kMaxQ = 1.5F, kMinRoot2 = 1e-3F;

// Where a ray is along its way to an asphere.
struct AsphereStep {
  float t;         // distance along the ray
  float rest;      // distance from the face before the last step, along z
  float approach;  // rate at which the ray approached the face there, along z
};

struct AspherePlace {
  float x, y, z;        // of the ray at its t
  float height, slope;  // of the face there: the slope over r^2, twice
  float root2;          // of the conic
};

// Position of a ray at t, with height and slope of the face there. Terms: number of even terms evaluated, of which the
// unused ones are 0. General: with odd terms, or even terms over the root.
template <int Terms, bool General>
RELIGN_DEVICE AspherePlace place_at(const Op& op, float t, const FloatRay& ray) {
  AspherePlace place;
  place.x = multiply_add(t, ray.lx, ray.x);
  place.y = multiply_add(t, ray.ly, ray.y);
  place.z = multiply_add(t, ray.lz, ray.z - op.vertex_z);
  const float r2 = multiply_add(place.x, place.x, place.y * place.y);
  const float kappa_c2 = op.conic_plus_1 * op.curvature * op.curvature;
  place.root2 = multiply_add(-kappa_c2, r2, 1.0F);
  const float root2 = larger(place.root2, kMinRoot2);
  const float root = square_root(root2);
  const float q = smaller(r2 * op.per_shape_radius2, kMaxQ);
  float bump = 0.0F, bump_slope = 0.0F;
  for (int k = Terms - 1; k >= 0; --k) {
    bump = multiply_add(bump, q, op.even[k]);
    bump_slope = multiply_add(bump_slope, q, static_cast<float>(k + 1) * op.even[k]);
  }
  bump *= q;
  bump_slope *= op.per_shape_radius2;
  if (General) {
    if (op.over_root) {
      bump /= root;
      bump_slope = multiply_add(0.5F * kappa_c2, bump / root2, bump_slope / root);
    }
    const float root_q = square_root(q);
    float odd = 0.0F, odd_slope = 0.0F;
    for (int k = kOddTerms - 1; k >= 0; --k) {
      odd = multiply_add(odd, q, op.odd[k]);
      odd_slope = multiply_add(odd_slope, q, (static_cast<float>(k) + 1.5F) * op.odd[k]);
    }
    bump = multiply_add(odd, q * root_q, bump);
    bump_slope = multiply_add(odd_slope, root_q * op.per_shape_radius2, bump_slope);
  }
  place.height = multiply_add(op.curvature, r2 / (1.0F + root), bump);
  place.slope = multiply_add(2.0F, bump_slope, op.curvature / root);
  return place;
}

// Distance to the conic c (x^2 + y^2 + kappa z^2) = 2 z: the face itself, or the conic near a polynomial.
RELIGN_DEVICE float conic_distance(const FloatRay& ray, const Op& op) {
  const float vertex = op.vertex_z + op.near_vertex, c = op.near_curvature, minus_c = -op.near_curvature;
  const float kappa = op.near_conic_plus_1, k = op.near_conic_plus_1 - 1.0F;
  const float x = ray.x, y = ray.y, z = ray.z - vertex;
  const float lx = ray.lx, ly = ray.ly, lz = ray.lz;
  const float along = multiply_add(x, lx, multiply_add(y, ly, kappa * z * lz));
  const float square = multiply_add(x, x, multiply_add(y, y, kappa * z * z));
  const float a = c * multiply_add(k * lz, lz, 1.0F);
  const float b = multiply_add(minus_c, along, lz);
  const float f = multiply_add(c, square, -2.0F * z);
  const float discriminant = multiply_add(b, b, -a * f);
  return f / (b - square_root(magnitude(discriminant)));
}

template <int Terms, bool General>
RELIGN_DEVICE void newton_step(const FloatRay& ray, const Op& op, AsphereStep& step) {
  const AspherePlace place = place_at<Terms, General>(op, step.t, ray);
  step.rest = place.z - place.height;
  step.approach = multiply_add(-place.slope, multiply_add(place.x, ray.lx, place.y * ray.ly), ray.lz);
  step.t -= step.rest / step.approach;
}

// `rest`: of the last step, or huge for a ray that misses the face.
template <int Terms, bool General, bool Fresnel>
RELIGN_DEVICE void refract_asphere(FloatRay& ray, const Op& op, float t, float rest) {
  const float ratio = op.index_ratio;
  const float minus_ratio2 = -ratio * ratio;
  const float lx = ray.lx, ly = ray.ly, lz = ray.lz;
  const AspherePlace place = place_at<Terms, General>(op, t, ray);
  const float x = place.x, y = place.y, slope = place.slope;
  const float r2 = multiply_add(x, x, y * y);
  const float length = square_root(multiply_add(slope * slope, r2, 1.0F));
  const float nz = 1.0F / length;  // normal towards +z: (-slope x, -slope y, 1) / length
  const float slanted = slope * nz;
  const float cosine = multiply_add(slanted, multiply_add(x, lx, y * ly), -lz * nz);
  const float refracted = multiply_add(minus_ratio2, multiply_add(-cosine, cosine, 1.0F), 1.0F);
  const float cosine_after = square_root(magnitude(refracted));
  const float g = multiply_add(ratio, cosine, -cosine_after);
  const float gs = -g * slanted;
  ray.x = x;
  ray.y = y;
  ray.z = place.z;
  ray.lx = multiply_add(ratio, lx, gs * x);
  ray.ly = multiply_add(ratio, ly, gs * y);
  ray.lz = multiply_add(ratio, lz, g * nz);
  const float edge = multiply_add(-x, x, multiply_add(-y, y, op.clear_radius2));
  const float near = kMetRest * op.shape_radius - magnitude(rest);
  ray.margin = smaller(smaller(smaller(ray.margin, near), smaller(edge, place.root2)), smaller(cosine, refracted));
  if (Fresnel) transmit(ray, op.index_after / op.index_before, cosine, cosine_after);
}

// All operations of an image path, for one ray. Faces with a polynomial are not among them: see above.
template <bool Fresnel>
RELIGN_DEVICE void trace_ray(FloatRay& ray, const Op* ops, std::int32_t op_count) {
  int faces = 0;
  for (std::int32_t k = 0; k < op_count; ++k) {
    const Op& op = ops[k];
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
        AsphereStep step = {conic_distance(ray, op), 0.0F, 0.0F};
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
