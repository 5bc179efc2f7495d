// Each operation traced back in double: what it says of a ray's start equals central differences of the operation.
#include "optics/adjoint_steps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <relign/random.hpp>

namespace relign::optics::adjoint_steps {
namespace {

using Ray = RayOf<double>;
using Adjoint = AdjointOf<double>;

// A downward ray from about z = 4 that meets the surfaces of these tests near their vertex.
Ray random_ray(Random& random) {
  const double l = random.uniform(-0.3, 0.3), m = random.uniform(-0.3, 0.3);
  return {random.uniform(-1, 1),
          random.uniform(-1, 1),
          random.uniform(3, 4),
          l,
          m,
          -std::sqrt(1 - l * l - m * m),
          1,
          1,
          1e9};
}

void to_asphere(Ray& ray, const ExactOp& op) {
  AsphereStep<double> step = {conic_distance(ray, op), 0, 0};
  for (int k = 0; k < 20; ++k) newton_step<kEvenTerms, true>(ray, op, step);
  refract_asphere<kEvenTerms, true, true>(ray, op, step.t, step.rest);
}

void apply(Ray& ray, const ExactOp& op) {
  switch (op.kind) {
    case Op::frame:
      return apply_frame(ray, op);
    case Op::shift:
      return apply_shift(ray, op);
    case Op::face:
      return intersect_face<true>(ray, op);
    case Op::asphere:
      return to_asphere(ray, op);
    case Op::stop:
      return intersect_stop(ray, op);
    case Op::bore:
      return intersect_bore(ray, op);
  }
}

// A value of the ray behind the operation: linear in its state, plus the logarithm of its transmittance. Edges are left
// out: they are integrals over rays.
struct Value {
  double state[6];
  double of(const Ray& ray) const {
    return std::log(transmittance(ray)) + state[0] * ray.x + state[1] * ray.y + state[2] * ray.z + state[3] * ray.lx +
           state[4] * ray.ly + state[5] * ray.lz;
  }
  Adjoint slopes() const { return {state[0], state[1], state[2], state[3], state[4], state[5]}; }
};

Value random_value(Random& random) {
  Value value{};
  for (double& number : value.state) number = random.uniform(-1, 1);
  return value;
}

// A ray moved and turned by a small rigid motion; it stays of unit length.
Ray moved(const Ray& ray, const double (&shift)[3], const double (&turn)[3]) {
  Ray out = ray;
  out.x += shift[0];
  out.y += shift[1];
  out.z += shift[2];
  const double angle = std::sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
  if (angle == 0) return out;
  const double k[3] = {turn[0] / angle, turn[1] / angle, turn[2] / angle};
  const double l[3] = {ray.lx, ray.ly, ray.lz};
  const double along = k[0] * l[0] + k[1] * l[1] + k[2] * l[2];
  double to[3];
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, n = (i + 2) % 3;
    to[i] =
        l[i] * std::cos(angle) + (k[j] * l[n] - k[n] * l[j]) * std::sin(angle) + k[i] * along * (1 - std::cos(angle));
  }
  out.lx = to[0];
  out.ly = to[1];
  out.lz = to[2];
  return out;
}

// All five freedoms of a ray and one that changes nothing (along itself).
void check(const ExactOp& op, int seed) {
  Random random(static_cast<std::uint64_t>(seed));
  ExactOp open = op;
  open.clear_radius2 = 1e12;  // no edge pulls
  for (int trial = 0; trial < 50; ++trial) {
    const Ray ray = random_ray(random);
    const Value value = random_value(random);
    Ray behind = ray;
    apply(behind, open);
    ASSERT_GT(behind.margin, 0);
    Adjoint none_x{}, none_y{}, a = value.slopes();
    operation_back<Carries::light, kEvenTerms, true>(none_x, none_y, a, open, ray, behind);
    for (int freedom = 0; freedom < 6; ++freedom) {
      double shift[3] = {}, turn[3] = {};
      (freedom < 3 ? shift : turn)[freedom % 3] = 1;
      const double h = 1e-5;
      const auto at = [&](double sign) {
        double by[3], round[3];
        for (int i = 0; i < 3; ++i) {
          by[i] = sign * h * shift[i];
          round[i] = sign * h * turn[i];
        }
        Ray one = moved(ray, by, round);
        apply(one, open);
        return value.of(one);
      };
      const double difference = (at(1) - at(-1)) / (2 * h);
      const double l[3] = {ray.lx, ray.ly, ray.lz}, b[3] = {a.lx, a.ly, a.lz};
      double expected = shift[0] * a.x + shift[1] * a.y + shift[2] * a.z;
      for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, n = (i + 2) % 3;
        expected += b[i] * (turn[j] * l[n] - turn[n] * l[j]);
      }
      EXPECT_NEAR(expected, difference, 2e-8 * (1 + std::abs(difference))) << "freedom " << freedom;
    }
  }
}

ExactOp face(double curvature) {
  ExactOp op{};
  op.kind = Op::face;
  op.vertex_z = 0.7;
  op.curvature = curvature;
  op.index_before = 1;
  op.index_after = 1.6;
  op.index_ratio = op.index_before / op.index_after;
  return op;
}

ExactOp asphere(double curvature, double conic) {
  ExactOp op = face(curvature);
  op.kind = Op::asphere;
  op.conic_plus_1 = op.near_conic_plus_1 = 1 + conic;
  op.near_curvature = curvature;
  op.shape_radius = 4;
  op.per_shape_radius2 = 1.0 / 16;
  return op;
}

TEST(AdjointSteps, AreTheDerivativesOfSpheresAndPlanes) {
  check(face(0.12), 1);
  check(face(-0.2), 2);
  check(face(0), 3);
}

TEST(AdjointSteps, AreTheDerivativesFromGlassToAir) {
  ExactOp op = face(0.1);
  op.index_before = 1.6;
  op.index_after = 1;
  op.index_ratio = 1.6;
  check(op, 4);
}

TEST(AdjointSteps, AreTheDerivativesOfConicsAndPolynomials) {
  check(asphere(0.1, -1.3), 5);
  ExactOp even = asphere(-0.08, 0.4);
  even.even_terms = 4;
  even.even[0] = 0.05;
  even.even[1] = -0.2;
  even.even[2] = 0.1;
  even.even[3] = 0.3;
  check(even, 6);
  ExactOp odd = even;
  odd.odd_terms = 2;
  odd.odd[0] = 0.07;
  odd.odd[1] = -0.1;
  check(odd, 7);
  ExactOp over_root = even;
  over_root.over_root = 1;
  check(over_root, 8);
}

TEST(AdjointSteps, AreTheDerivativesOfFramesStopsAndBores) {
  ExactOp frame{};
  frame.kind = Op::frame;
  const double c = std::cos(0.3), s = std::sin(0.3);
  const double rotation[9] = {c, -s, 0, s, c, 0, 0, 0, 1};
  std::copy(rotation, rotation + 9, frame.rotation);
  frame.translation[0] = 0.3;
  frame.translation[2] = -0.2;
  check(frame, 9);
  ExactOp op{};
  op.vertex_z = 0.4;
  for (const auto kind : {Op::shift, Op::stop, Op::bore}) {
    op.kind = kind;
    check(op, 10);
  }
}

// A disc of uniform value v(x, y) behind a stop: the derivative of its sum by the place of the stop is that of the
// integral over the disc, whose edge moves.
TEST(AdjointSteps, EdgesMoveWithTheirAperture) {
  ExactOp op{};
  op.kind = Op::stop;
  op.clear_radius2 = 4;
  const auto value = [](double x, double y) { return 1 + 0.3 * x - 0.2 * y + 0.1 * x * y + 0.05 * x * x; };
  // Shifting the stop by (dx, 0): the flux through its edge, the integral of dv/dx over the disc = 0.3 pi R^2.
  const int n = 2000;
  const double cell = 4.4 / n;
  double sum_x = 0, sum_y = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double x = -2.2 + (i + 0.5) * cell, y = -2.2 + (j + 0.5) * cell;
      if (x * x + y * y > 4) continue;
      const Ray before = {x, y, 1, 0, 0, -1, 1, 1, 1};
      Ray behind = before;
      intersect_stop(behind, op);
      Adjoint none_x{}, none_y{}, light{};
      operation_back<Carries::light, kEvenTerms, true>(none_x, none_y, light, op, before, behind);
      // A shift of the stop is the opposite shift of the ray.
      sum_x -= light.x * value(x, y) * cell * cell;
      sum_y -= light.y * value(x, y) * cell * cell;
    }
  const double area = 3.14159265358979 * 4;
  EXPECT_NEAR(sum_x, 0.3 * area, 0.002 * area);
  EXPECT_NEAR(sum_y, -0.2 * area, 0.002 * area);
}

// The share of directions that a ray stands for: a wrench of constant radiance, summed over the pupil, is the
// derivative of the pupil's area in direction cosines.
TEST(AdjointSteps, RaysThatFollowThePupilKeepItsSolidAngle) {
  const double z = -7, normal[3] = {0, 0, 1};
  const double n = 400, reach = 2.0;
  // Of the integral of dp dq over a square of side 2 in the plane z, seen from (0.5, -0.3, 0).
  const auto area = [&](double sx, double sy, double sz, double tilt_y) {
    double sum = 0;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const double u = (-1 + (i + 0.5) * reach / n), v = (-1 + (j + 0.5) * reach / n);
        // The point of the square after its turn about y through the origin, and its shift.
        const double px = u * std::cos(tilt_y) + z * std::sin(tilt_y) + sx, py = v + sy;
        const double pz = -u * std::sin(tilt_y) + z * std::cos(tilt_y) + sz;
        const double dx = px - 0.5, dy = py + 0.3, dz = pz;
        const double r2 = dx * dx + dy * dy + dz * dz, r = std::sqrt(r2);
        const double cosine = std::abs(std::sin(tilt_y) * dx + std::cos(tilt_y) * dz) / r;
        sum += std::abs(dz) / r * cosine / r2;
      }
    return sum * reach * reach / (n * n);
  };
  WrenchOf<double> sum{};
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double dx = -1 + (i + 0.5) * reach / n - 0.5, dy = -1 + (j + 0.5) * reach / n + 0.3;
      const double r = std::sqrt(dx * dx + dy * dy + z * z);
      const Ray ray = {0.5, -0.3, 0, dx / r, dy / r, z / r, 1, 1, 1};
      const double weight = z * z / (r * r * r * r) * reach * reach / (n * n);
      const WrenchOf<double> w = pupil_wrench<double>(ray, {}, 1.0, normal, z, normal);
      sum.fx += w.fx * weight;
      sum.fy += w.fy * weight;
      sum.fz += w.fz * weight;
      sum.ty += w.ty * weight;
    }
  const double h = 1e-4;
  EXPECT_NEAR(sum.fx, (area(h, 0, 0, 0) - area(-h, 0, 0, 0)) / (2 * h), 1e-6);
  EXPECT_NEAR(sum.fy, (area(0, h, 0, 0) - area(0, -h, 0, 0)) / (2 * h), 1e-6);
  EXPECT_NEAR(sum.fz, (area(0, 0, h, 0) - area(0, 0, -h, 0)) / (2 * h), 1e-6);
  EXPECT_NEAR(sum.ty, (area(0, 0, 0, h) - area(0, 0, 0, -h)) / (2 * h), 1e-6);
}

}  // namespace
}  // namespace relign::optics::adjoint_steps
