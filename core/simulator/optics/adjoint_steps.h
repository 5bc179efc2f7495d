// Derivatives of what one ray carries by its start and by every motion of the parts it passes, in reverse: each
// function takes the derivative of a value by the ray behind an operation back to the ray in front of it. The
// operations themselves are in ray_steps.h and asphere_steps.h; docs/derivatives.md has the formulas.
//
// Compiled for several instruction sets, and written like ray_steps.h, so that NVRTC can compile it; no GPU kernel uses
// it yet.
#pragma once

#include "optics/adjoint_block.h"
#include "optics/asphere_steps.h"

#if defined(__CUDACC_RTC__)
#define RELIGN_UNROLL _Pragma("unroll")
#else
#define RELIGN_UNROLL _Pragma("GCC unroll 16")
#endif

namespace relign::optics {

// Derivative of a value F by the position and the direction of a ray, as vectors of its frame.
template <class Real>
struct AdjointOf {
  Real x, y, z;     // dF / dposition, per mm
  Real lx, ly, lz;  // dF / ddirection
};

// Derivative of F by a rigid motion of everything that the ray meets later: by its shift (per mm) and by its turn about
// the frame's origin (per rad).
template <class Real>
struct WrenchOf {
  Real fx, fy, fz;
  Real tx, ty, tz;
};

// What F has of an operation besides the adjoint of the ray behind it.
enum class Carries {
  position,    // nothing: F is the place of a hit
  light,       // F is the logarithm of the transmittance of faces, and whether apertures let the ray pass
  light_free,  // the same where faces transmit everything
};

// Which rays stand for an edge, whose motion lets light in or out: those inside it, at 0 <= distance < width, with this
// weight. It is 1 in the mean and has no first moment, so that the integral over the edge is extrapolated from the
// inside with an error of second order in the width.
template <class Real>
RELIGN_DEVICE Real edge_weight(Real distance, Real per_width) {
  const Real share = distance * per_width;
  return share < Real{1} ? (Real{4} - Real{6} * share) * per_width : Real{0};
}
// Width of the edge of an aperture, in its semi-diameter^2.
constexpr float kEdgeWidth = 0.06F;

// dF / d(semi-diameter^2 - distance from the axis^2) of a ray that passes an aperture at (x, y), per mm^2.
template <class Real>
RELIGN_DEVICE Real edge_pull(const OpOf<Real>& op, Real x, Real y) {
  const Real edge = multiply_add(-x, x, multiply_add(-y, y, op.clear_radius2));
  return edge_weight(edge, Real{1} / (Real{kEdgeWidth} * op.clear_radius2));
}

template <class Real>
RELIGN_DEVICE WrenchOf<Real> wrench_of(const RayOf<Real>& ray, const AdjointOf<Real>& a) {
  return {a.x,
          a.y,
          a.z,
          ray.y * a.z - ray.z * a.y + ray.ly * a.lz - ray.lz * a.ly,
          ray.z * a.x - ray.x * a.z + ray.lz * a.lx - ray.lx * a.lz,
          ray.x * a.y - ray.y * a.x + ray.lx * a.ly - ray.ly * a.lx};
}

// The adjoint of a ray in front of a surface with normal (nx, ny, nz), from that of its hit (in place of the position)
// and of its direction, which the surface may have changed already: the hit stays on the surface. per_approach: 1 /
// (normal * direction).
template <class Real>
RELIGN_DEVICE void slide_back(AdjointOf<Real>& a, Real t, const RayOf<Real>& before, Real nx, Real ny, Real nz,
                              Real per_approach) {
  const Real w = per_approach * (a.x * before.lx + a.y * before.ly + a.z * before.lz);
  a.x = multiply_add(-w, nx, a.x);
  a.y = multiply_add(-w, ny, a.y);
  a.z = multiply_add(-w, nz, a.z);
  a.lx = multiply_add(t, a.x, a.lx);
  a.ly = multiply_add(t, a.y, a.ly);
  a.lz = multiply_add(t, a.z, a.lz);
}

template <class Real>
RELIGN_DEVICE Real way_between(const RayOf<Real>& before, Real x, Real y, Real z) {
  return (x - before.x) * before.lx + (y - before.y) * before.ly + (z - before.z) * before.lz;
}

template <class Real>
RELIGN_DEVICE void frame_back(AdjointOf<Real>& a, const OpOf<Real>& op) {
  const Real* const r = op.rotation;
  const AdjointOf<Real> b = a;
  a.x = r[0] * b.x + r[3] * b.y + r[6] * b.z;
  a.y = r[1] * b.x + r[4] * b.y + r[7] * b.z;
  a.z = r[2] * b.x + r[5] * b.y + r[8] * b.z;
  a.lx = r[0] * b.lx + r[3] * b.ly + r[6] * b.lz;
  a.ly = r[1] * b.lx + r[4] * b.ly + r[7] * b.lz;
  a.lz = r[2] * b.lx + r[5] * b.ly + r[8] * b.lz;
}

// What happens at a face: the same for all that is traced back.
template <class Real>
struct Refraction {
  Real nx, ny, nz;               // unit normal, towards +z
  Real per_cosine;               // of the cosine of incidence
  Real g, g_slope;               // direction behind = ratio * direction + g * normal; slope by the cosine
  Real log_transmittance_slope;  // by the cosine, that of refraction following
};

template <Carries What, class Real>
RELIGN_DEVICE Refraction<Real> refraction_at(const OpOf<Real>& op, const RayOf<Real>& before, const RayOf<Real>& behind,
                                             Real nx, Real ny, Real nz) {
  const Real ratio = op.index_ratio;
  const Real cosine = -multiply_add(before.lx, nx, multiply_add(before.ly, ny, before.lz * nz));
  const Real after = -multiply_add(behind.lx, nx, multiply_add(behind.ly, ny, behind.lz * nz));
  const Real per_both = Real{1} / (cosine * after);
  Refraction<Real> face;
  face.nx = nx;
  face.ny = ny;
  face.nz = nz;
  face.per_cosine = per_both * after;
  const Real per_after = per_both * cosine;
  const Real after_slope = ratio * ratio * cosine * per_after;
  face.g = multiply_add(ratio, cosine, -after);
  face.g_slope = ratio - after_slope;
  face.log_transmittance_slope = Real{0};
  if (What == Carries::light) {  // of transmit()
    const Real back_ratio = Real{1} / op.index_ratio;
    const Real a = multiply_add(back_ratio, after, cosine), d = multiply_add(back_ratio, cosine, after);
    const Real squares = multiply_add(a, a, d * d), ad = a * d;
    const Real per = Real{2} / (ad * squares);  // 2 a / squares - 2 / a = 2 (a^2 - squares) / (a squares)
    const Real by_a = -per * d * d * d, by_d = -per * a * a * a;
    const Real by_cosine = face.per_cosine + by_a + back_ratio * by_d;
    const Real by_after = per_after + back_ratio * by_a + by_d;
    face.log_transmittance_slope = multiply_add(by_after, after_slope, by_cosine);
  }
  return face;
}

// To the direction in front of a face. Returns the adjoint of the normal.
template <class Real>
struct NormalAdjoint {
  Real x, y, z;
};
template <Carries What, class Real>
RELIGN_DEVICE NormalAdjoint<Real> refract_back(AdjointOf<Real>& a, const OpOf<Real>& op, const RayOf<Real>& before,
                                               const Refraction<Real>& face) {
  const Real along_normal = multiply_add(a.lx, face.nx, multiply_add(a.ly, face.ny, a.lz * face.nz));
  Real by_cosine = along_normal * face.g_slope;
  if (What == Carries::light) by_cosine += face.log_transmittance_slope;
  const NormalAdjoint<Real> normal = {multiply_add(face.g, a.lx, -by_cosine * before.lx),
                                      multiply_add(face.g, a.ly, -by_cosine * before.ly),
                                      multiply_add(face.g, a.lz, -by_cosine * before.lz)};
  const Real ratio = op.index_ratio;
  a.lx = multiply_add(ratio, a.lx, -by_cosine * face.nx);
  a.ly = multiply_add(ratio, a.ly, -by_cosine * face.ny);
  a.lz = multiply_add(ratio, a.lz, -by_cosine * face.nz);
  return normal;
}

template <class Real>
RELIGN_DEVICE void pull_inwards(AdjointOf<Real>& a, const OpOf<Real>& op, Real x, Real y) {
  const Real pull = Real{2} * edge_pull(op, x, y);
  a.x -= pull * x;
  a.y -= pull * y;
}

// A face where a ray meets it.
template <class Real>
struct FaceHit {
  Refraction<Real> refraction;
  Real way;                      // along the ray, from where it was
  Real slope, bend, per_length;  // of an asphere, see AsphereBend; 1 / length of (-slope x, -slope y, 1)
};

template <Carries What, class Real>
RELIGN_DEVICE FaceHit<Real> face_hit(const OpOf<Real>& op, const RayOf<Real>& before, const RayOf<Real>& behind) {
  const Real c = op.curvature;
  FaceHit<Real> hit;
  hit.refraction =
      refraction_at<What>(op, before, behind, -c * behind.x, -c * behind.y, multiply_add(-c, behind.z, Real{1}));
  hit.way = way_between(before, behind.x, behind.y, behind.z + op.vertex_z);
  hit.slope = hit.bend = hit.per_length = Real{0};
  return hit;
}

template <Carries What, class Real>
RELIGN_DEVICE void face_back(AdjointOf<Real>& a, const OpOf<Real>& op, const RayOf<Real>& before,
                             const RayOf<Real>& behind, const FaceHit<Real>& hit) {
  const Refraction<Real>& face = hit.refraction;
  const NormalAdjoint<Real> normal = refract_back<What>(a, op, before, face);
  const Real c = op.curvature;
  a.x = multiply_add(-c, normal.x, a.x);
  a.y = multiply_add(-c, normal.y, a.y);
  a.z = multiply_add(-c, normal.z, a.z);
  if (What != Carries::position) pull_inwards(a, op, behind.x, behind.y);
  slide_back(a, hit.way, before, face.nx, face.ny, face.nz, -face.per_cosine);
}

// Slope of an asphere over r^2, twice (place_at()), and its derivative by r^2.
template <class Real>
struct AsphereBend {
  Real slope, bend;
};
// Terms, General: as of place_at().
template <int Terms, bool General, class Real>
RELIGN_DEVICE AsphereBend<Real> bend_at(const OpOf<Real>& op, Real x, Real y) {
  const Real r2 = multiply_add(x, x, y * y);
  const Real kappa_c2 = op.conic_plus_1 * op.curvature * op.curvature;
  const Real root2 = larger(multiply_add(-kappa_c2, r2, Real{1}), Real{kMinRoot2});
  const Real root = square_root(root2);
  const Real per = op.per_shape_radius2;
  const Real q = smaller(r2 * per, Real{kMaxQ});
  Real even = Real{0}, slope = Real{0}, bend = Real{0};  // of the sum by q, and its derivatives
  RELIGN_UNROLL  // else GCC sees control flow, and no loop over rays is vectorised
      for (int k = Terms - 1; k >= 0; --k) {
    bend = multiply_add(bend, q, Real{2} * slope);
    slope = multiply_add(slope, q, even);
    even = multiply_add(even, q, op.even[k]);
  }
  bend = multiply_add(bend, q, Real{2} * slope);
  slope = multiply_add(slope, q, even);
  even *= q;
  slope *= per;
  bend *= per * per;
  if (General) {
    if (op.over_root) {  // of even / root, where 1 / root has the derivative kappa_c2 / (2 root^3)
      const Real half = Real{0.5} * kappa_c2 / root2;
      bend = (bend + Real{2} * half * slope + Real{3} * half * half * even) / root;
      slope = multiply_add(half, even, slope) / root;
    }
    const Real root_q = square_root(q);
    Real odd_slope = Real{0}, odd_bend = Real{0};  // over root_q, and over 1 / root_q
    RELIGN_UNROLL
    for (int k = kOddTerms - 1; k >= 0; --k) {
      const Real power = static_cast<Real>(k) + Real{1.5};
      odd_slope = multiply_add(odd_slope, q, power * op.odd[k]);
      odd_bend = multiply_add(odd_bend, q, power * (power - Real{1}) * op.odd[k]);
    }
    slope = multiply_add(odd_slope, root_q * per, slope);
    bend = multiply_add(odd_bend, per * per / larger(root_q, Real{1e-6F}), bend);
  }
  const Real conic = op.curvature / root;
  return {multiply_add(Real{2}, slope, conic), multiply_add(Real{2}, bend, Real{0.5} * kappa_c2 * conic / root2)};
}

template <Carries What, int Terms, bool General, class Real>
RELIGN_DEVICE FaceHit<Real> asphere_hit(const OpOf<Real>& op, const RayOf<Real>& before, const RayOf<Real>& behind) {
  const AsphereBend<Real> shape = bend_at<Terms, General>(op, behind.x, behind.y);
  const Real sx = -shape.slope * behind.x, sy = -shape.slope * behind.y;
  FaceHit<Real> hit;
  hit.slope = shape.slope;
  hit.bend = shape.bend;
  hit.per_length = Real{1} / square_root(multiply_add(sx, sx, multiply_add(sy, sy, Real{1})));
  hit.refraction = refraction_at<What>(op, before, behind, sx * hit.per_length, sy * hit.per_length, hit.per_length);
  hit.way = way_between(before, behind.x, behind.y, behind.z + op.vertex_z);
  return hit;
}

template <Carries What, class Real>
RELIGN_DEVICE void asphere_back(AdjointOf<Real>& a, const OpOf<Real>& op, const RayOf<Real>& before,
                                const RayOf<Real>& behind, const FaceHit<Real>& hit) {
  const Real x = behind.x, y = behind.y;
  const Refraction<Real>& face = hit.refraction;
  const NormalAdjoint<Real> normal = refract_back<What>(a, op, before, face);
  // Of (-slope x, -slope y, 1), before it is normalised.
  const Real along = normal.x * face.nx + normal.y * face.ny + normal.z * face.nz;
  const Real bx = hit.per_length * (normal.x - along * face.nx), by = hit.per_length * (normal.y - along * face.ny);
  const Real by_r2 = Real{-2} * hit.bend * (bx * x + by * y);
  a.x += multiply_add(by_r2, x, -hit.slope * bx);
  a.y += multiply_add(by_r2, y, -hit.slope * by);
  if (What != Carries::position) pull_inwards(a, op, x, y);
  slide_back(a, hit.way, before, face.nx, face.ny, face.nz, -face.per_cosine);
}

template <Carries What, class Real>
RELIGN_DEVICE void stop_back(AdjointOf<Real>& a, const OpOf<Real>& op, const RayOf<Real>& before,
                             const RayOf<Real>& behind) {
  if (What != Carries::position) pull_inwards(a, op, behind.x, behind.y);
  a.z = Real{0};
  const Real per = Real{1} / before.lz;
  slide_back(a, (op.vertex_z - before.z) * per, before, Real{0}, Real{0}, Real{1}, per);
}

// The bore does not move the ray.
template <class Real>
RELIGN_DEVICE void bore_back(AdjointOf<Real>& a, const OpOf<Real>& op, const RayOf<Real>& before) {
  const Real height = before.z - op.vertex_z;
  const Real per = Real{1} / before.lz;
  const Real t = -larger(height, Real{0}) * per;
  AdjointOf<Real> rim = {Real{0}, Real{0}, Real{0}, Real{0}, Real{0}, Real{0}};
  pull_inwards(rim, op, multiply_add(t, before.lx, before.x), multiply_add(t, before.ly, before.y));
  AdjointOf<Real> slid = rim;
  slide_back(slid, t, before, Real{0}, Real{0}, Real{1}, per);
  const bool in_front = height > Real{0};
  a.x += rim.x;
  a.y += rim.y;
  a.z += in_front ? slid.z : Real{0};
  a.lx += in_front ? slid.lx : Real{0};
  a.ly += in_front ? slid.ly : Real{0};
  a.lz += in_front ? slid.lz : Real{0};
}

// Back from a hit on the emitter's plane, one of whose coordinates is F, to the ray before it.
template <class Real>
RELIGN_DEVICE AdjointOf<Real> hit_back(const RayOf<Real>& before, Real distance_z, Real by_x, Real by_y) {
  AdjointOf<Real> a = {by_x, by_y, Real{0}, Real{0}, Real{0}, Real{0}};
  const Real per = Real{1} / before.lz;
  slide_back(a, (distance_z - before.z) * per, before, Real{0}, Real{0}, Real{1}, per);
  return a;
}

// x times by_x and so on.
template <class Real>
RELIGN_DEVICE AdjointOf<Real> combined(const AdjointOf<Real>& x, Real by_x, const AdjointOf<Real>& y, Real by_y,
                                       const AdjointOf<Real>& light, Real by_light) {
  return {by_x * x.x + by_y * y.x + by_light * light.x,    by_x * x.y + by_y * y.y + by_light * light.y,
          by_x * x.z + by_y * y.z + by_light * light.z,    by_x * x.lx + by_y * y.lx + by_light * light.lx,
          by_x * x.ly + by_y * y.ly + by_light * light.ly, by_x * x.lz + by_y * y.lz + by_light * light.lz};
}

// In the coordinates p' = R p + t.
template <class Real>
RELIGN_DEVICE WrenchOf<Real> moved_to(const WrenchOf<Real>& w, const Real* r, const Real* t) {
  const Real fx = r[0] * w.fx + r[1] * w.fy + r[2] * w.fz;
  const Real fy = r[3] * w.fx + r[4] * w.fy + r[5] * w.fz;
  const Real fz = r[6] * w.fx + r[7] * w.fy + r[8] * w.fz;
  return {fx,
          fy,
          fz,
          r[0] * w.tx + r[1] * w.ty + r[2] * w.tz + t[1] * fz - t[2] * fy,
          r[3] * w.tx + r[4] * w.ty + r[5] * w.tz + t[2] * fx - t[0] * fz,
          r[6] * w.tx + r[7] * w.ty + r[8] * w.tz + t[0] * fy - t[1] * fx};
}

// What F changes by, as a wrench, because a ray moves with the pupil: the point where it crosses the plane normal * p =
// distance follows the lens, and its place on the sensor does not. light: the value of the ray, which is proportional
// to the share of directions that it stands for; 0 if F is not light. ray, a: at the sensor; across: its normal.
template <class Real>
RELIGN_DEVICE WrenchOf<Real> pupil_wrench(const RayOf<Real>& ray, const AdjointOf<Real>& a, Real light,
                                          const Real* normal, Real distance, const Real* across) {
  const Real per_lens = Real{1} / (normal[0] * ray.lx + normal[1] * ray.ly + normal[2] * ray.lz);
  const Real way = (distance - (normal[0] * ray.x + normal[1] * ray.y + normal[2] * ray.z)) * per_lens;
  const Real px = multiply_add(way, ray.lx, ray.x), py = multiply_add(way, ray.ly, ray.y);
  const Real pz = multiply_add(way, ray.lz, ray.z);
  const Real along = a.lx * ray.lx + a.ly * ray.ly + a.lz * ray.lz;
  const Real per_way = Real{1} / way;
  const Real sensor = light / (across[0] * ray.lx + across[1] * ray.ly + across[2] * ray.lz), lens = light * per_lens;
  const Real rest = -along - Real{4} * light;
  const Real fx = per_way * (a.lx + rest * ray.lx + sensor * across[0] + lens * normal[0]);
  const Real fy = per_way * (a.ly + rest * ray.ly + sensor * across[1] + lens * normal[1]);
  const Real fz = per_way * (a.lz + rest * ray.lz + sensor * across[2] + lens * normal[2]);
  // normal x direction
  return {fx,
          fy,
          fz,
          py * fz - pz * fy + lens * (normal[1] * ray.lz - normal[2] * ray.ly),
          pz * fx - px * fz + lens * (normal[2] * ray.lx - normal[0] * ray.lz),
          px * fy - py * fx + lens * (normal[0] * ray.ly - normal[1] * ray.lx)};
}

// Back over one operation (Terms, General: of an asphere); x, y: adjoints of the coordinates of the hit on the
// emitter's plane, light: of the logarithm of the light.
template <Carries Light, int Terms, bool General, class Real>
RELIGN_DEVICE void operation_back(AdjointOf<Real>& x, AdjointOf<Real>& y, AdjointOf<Real>& light, const OpOf<Real>& op,
                                  const RayOf<Real>& before, const RayOf<Real>& behind) {
  switch (op.kind) {
    case OpKinds::frame:
      frame_back(x, op);
      frame_back(y, op);
      frame_back(light, op);
      break;
    case OpKinds::shift:
      break;
    case OpKinds::face: {
      const FaceHit<Real> hit = face_hit<Light>(op, before, behind);
      face_back<Carries::position>(x, op, before, behind, hit);
      face_back<Carries::position>(y, op, before, behind, hit);
      face_back<Light>(light, op, before, behind, hit);
      break;
    }
    case OpKinds::asphere: {
      const FaceHit<Real> hit = asphere_hit<Light, Terms, General>(op, before, behind);
      asphere_back<Carries::position>(x, op, before, behind, hit);
      asphere_back<Carries::position>(y, op, before, behind, hit);
      asphere_back<Light>(light, op, before, behind, hit);
      break;
    }
    case OpKinds::stop:
      stop_back<Carries::position>(x, op, before, behind);
      stop_back<Carries::position>(y, op, before, behind);
      stop_back<Light>(light, op, before, behind);
      break;
    case OpKinds::bore:
      bore_back(light, op, before);
      break;
  }
}

// ---- The slope of the radiance, in the mean over a pixel ----

// How a hit moves with the place on the sensor: columns of a matrix, mm per step of the place.
struct HitSteps {
  float x_by_u, y_by_u, x_by_v, y_by_v;
};

// What one coordinate of the hit, whose adjoint at the sensor this is, changes by when the place moves by `step` and
// the point of the pupil is kept.
RELIGN_DEVICE float hit_step(const FloatRay& ray, const AdjointOf<float>& a, const SensorView& view,
                             const float* step) {
  const float* const n = view.pupil.normal;
  const float per_way = (n[0] * ray.lx + n[1] * ray.ly + n[2] * ray.lz) /
                        (view.pupil.distance - (n[0] * ray.x + n[1] * ray.y + n[2] * ray.z));
  const float along = a.lx * ray.lx + a.ly * ray.ly + a.lz * ray.lz;
  return step[0] * (a.x - per_way * (a.lx - along * ray.lx)) + step[1] * (a.y - per_way * (a.ly - along * ray.ly)) +
         step[2] * (a.z - per_way * (a.lz - along * ray.lz));
}

// Not above 0 where the hits of a pixel lie nearly on a line, as at a caustic. Then no motion of the place moves a hit
// as a motion of the lens does, and the slope at the hit itself is taken, over one texel.
RELIGN_DEVICE float spread_of(const HitSteps& steps) {
  constexpr float kFolded = 0.1F;  // of the area if the steps were equal and perpendicular
  const float u2 = multiply_add(steps.x_by_u, steps.x_by_u, steps.y_by_u * steps.y_by_u);
  const float v2 = multiply_add(steps.x_by_v, steps.x_by_v, steps.y_by_v * steps.y_by_v);
  const float area = multiply_add(steps.x_by_u, steps.y_by_v, -steps.x_by_v * steps.y_by_u);
  return multiply_add(-0.5F * kFolded, u2 + v2, magnitude(area));
}

// For (dx, dy), the motion of a hit: slope (x, y) times it is what the radiance at the hit changes by, in the mean over
// the places within a cell of the pixel around the ray's, along u and along v: the difference of the radiance at the
// ends over the length. It sees every edge of the target in the cell, the border of the square as well, where a slope
// at the hit would be rare and large. u, v: of the ray, in cells of this size, from 0 to 1.
struct MeanSlope {
  float x, y;
};
RELIGN_DEVICE float place_in_cell(float place, float cells) {
  const float at = cells * place;
  return at - static_cast<float>(static_cast<std::int32_t>(at));
}
template <bool EightBits>
RELIGN_DEVICE float radiance_at(const EmitterPlane& emitter, float x, float y) {
  FloatRay ray = {x, y, emitter.distance_z + 1.0F, 0.0F, 0.0F, -1.0F, 1.0F, 1.0F, 1.0F};
  return look_up<EightBits>(ray, emitter);
}
// along_u, along_v: differences of the radiance between the ends.
RELIGN_DEVICE MeanSlope mean_slope(const HitSteps& steps, float along_u, float along_v) {
  const float per = 1.0F / (steps.x_by_u * steps.y_by_v - steps.x_by_v * steps.y_by_u);
  return {per * (steps.y_by_v * along_u - steps.y_by_u * along_v),
          per * (steps.x_by_u * along_v - steps.x_by_v * along_u)};
}

}  // namespace relign::optics
