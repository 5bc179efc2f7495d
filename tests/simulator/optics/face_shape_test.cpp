// Conics and aspheres against closed forms and exhaustive search.
#include "optics/face_shape.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <relign/random.hpp>

#include "face_crossings.h"
#include "lens_under_test.h"
#include "optics/first_order.h"
#include "optics/trace.h"

namespace relign::optics {
namespace {

// A glass body from z = 0 to 10 mm with a plane on one side, and a stop before it.
Prescription body(const Face& front, const Face& back, double index) {
  Prescription lens;
  lens.elements = {{"L1", {front, back}, {}}};
  lens.elements[0].faces[0].index_after = index;
  lens.elements[0].faces[1].z_mm = 10;
  lens.stops = {{"stop", -1, 5, false, true}};
  return lens;
}

Face conic(double radius, double k) {
  Face face;
  face.curvature = radius == 0 ? 0 : 1 / radius;
  face.conic = k;
  face.clear_radius_mm = 8;
  return face;
}

double worst_height_at_image(const Prescription& lens) {
  double worst = 0;
  for (double h = 0.25; h < 4; h += 0.25) {
    const TracedRay traced = trace(Assembly(lens), {{0.3 * h, h, -2}, {0, 0, 1}}, Apertures::none);
    EXPECT_TRUE(traced.passed) << traced.lost_at;
    worst = std::max(worst, std::hypot(traced.image.x, traced.image.y));
  }
  return worst;
}

// Collimated light that leaves glass through a hyperboloid, k = -n^2, converges to a point (Descartes).
TEST(FaceShape, HyperboloidFocusesPerfectly) {
  const double n = 1.7;
  Prescription lens = body(conic(0, 0), conic(-8, -n * n), n);
  lens.image_z_mm = 10 + first_order(lens).back_focal_length;
  EXPECT_LT(worst_height_at_image(lens), 1e-12);
  lens.elements[0].faces[1].conic = 0;
  EXPECT_GT(worst_height_at_image(lens), 0.01) << "a sphere does not";
}

// Collimated light that enters glass through an ellipsoid, k = -1 / n^2, converges to its far focus, also in air behind
// a concentric sphere.
TEST(FaceShape, EllipsoidFocusesPerfectly) {
  const double n = 1.6, radius = 9;
  const double focus = radius * n / (n - 1);
  const double back = focus - 10;
  Prescription lens = body(conic(radius, -1 / (n * n)), conic(back, 0), n);
  lens.image_z_mm = focus;
  EXPECT_LT(worst_height_at_image(lens), 1e-12);
}

// A sphere equals a paraboloid plus c^3 r^4 / 8 + c^5 r^6 / 16 + ...: same rays within the truncation of the series.
TEST(FaceShape, PolynomialMatchesSphere) {
  Prescription polynomial = relign_od();
  double largest = 0;
  for (Element& element : polynomial.elements)
    for (Face& face : element.faces) {
      const double c = face.curvature;
      face.conic = -1;
      face.even_asphere.clear();
      double term = c / 2;  // binomial series of (1 - sqrt(1 - c^2 r^2)) / c
      for (std::size_t i = 2; i < 2 + kMaxEvenTerms; ++i) {
        const auto order = static_cast<double>(i);
        term *= c * c * (2 * order - 3) / (2 * order);
        face.even_asphere.push_back(term);
      }
    }
  const Assembly spheres(relign_od()), series(polynomial);
  Random random(3);
  int compared = 0;
  for (int i = 0; i < 400; ++i) {
    const Ray ray{{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), -1},
                  {random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 1}};
    const TracedRay a = trace(spheres, ray, Apertures::mesh), b = trace(series, ray, Apertures::mesh);
    ASSERT_EQ(a.passed, b.passed);
    if (!a.passed) continue;
    ++compared;
    largest = std::max(largest, std::hypot(a.image.x - b.image.x, a.image.y - b.image.y));
  }
  EXPECT_GT(compared, 200);
  EXPECT_LT(largest, 1e-9);
}

// The point is on the face and the normal is the gradient there, in either direction of the ray.
TEST(FaceShape, IntersectionsAreOnTheFace) {
  Random random(8);
  for (const Element& element : aspheric_relign_od().elements)
    for (const Face& face : element.faces)
      for (int i = 0; i < 50; ++i) {
        const double way = i % 2 == 0 ? 1 : -1;
        const Vec3 l = unit({random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4), way});
        const Vec3 through{random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5), 0};
        const auto met = intersect(face, bounds_of(face, valid_radius(face)), through - 30 * l, l);
        ASSERT_TRUE(met);
        const double r = std::hypot(met->at.x, met->at.y);
        EXPECT_NEAR(met->at.z, sag(face, r), 1e-11);
        const double step = 1e-5;
        const double slope = (sag(face, r + step) - sag(face, r - step)) / (2 * step);
        EXPECT_NEAR(-(met->normal.x * met->at.x + met->normal.y * met->at.y) / met->normal.z, slope * r, 1e-7);
        EXPECT_NEAR(dot(met->normal, met->normal), 1, 1e-14);
      }
}

TEST(FaceShape, ReportsMisses) {
  EXPECT_FALSE(intersect(conic(3, 0), {}, {0, 3.1, -1}, {0, 0, 1}));
  EXPECT_TRUE(intersect(conic(3, 0), {}, {0, 2.9, -1}, {0, 0, 1}));
  EXPECT_TRUE(intersect(conic(3, -1), {}, {0, 3.1, -1}, {0, 0, 1})) << "a paraboloid has no end";
  EXPECT_FALSE(intersect(conic(3, 1), {}, {0, 2.9, -1}, {0, 0, 1})) << "an oblate ellipsoid ends before";
  Face bent = conic(3, 0);
  bent.even_asphere = {1e-3};
  EXPECT_FALSE(intersect(bent, bounds_of(bent, valid_radius(bent)), {0, 3.1, -1}, {0, 0, 1}));
}

// A face of a phone lens: steep, bent back at the rim, with a polynomial that diverges outside.
Face gull_wing() {
  Face face;
  face.curvature = -0.35;
  face.conic = -6;
  face.even_asphere = {-0.21, 0.14, -0.052, 0.011, -0.0012, 0.00006};
  face.clear_radius_mm = 1.9;
  return face;
}

Face with_odd_terms() {
  Face face = gull_wing();
  face.r2_term = 0.08;
  face.odd_asphere = {-0.05, 0.012};
  return face;
}

Face of_forbes() {
  Face face;
  face.curvature = 0.3;
  face.clear_radius_mm = 1.9;
  face.over_root = over_root_terms_of_q_bfs({0.4, -0.1, 0.05, 0.02}, 2.0);
  return face;
}

// A steep asphere: a second derivative of 300 / mm at the rim, hardly any in the middle, waves in between.
Face violent() {
  Face face;
  face.curvature = 0.4;
  face.conic = -38;
  face.even_asphere = {-0.55, 0.93, -3.4, 6.1, -4.9, 1.35, -0.32};
  face.clear_radius_mm = 1.45;
  return face;
}

// Finds every hit and no others, for steep rays from both sides, against bisection; 1e-12 mm. By hand with
// RELIGN_FULL=1 over ten million rays.
TEST(FaceShape, FindsTheFirstHit) {
  const bool full = std::getenv("RELIGN_FULL") != nullptr;
  const int rays = full ? 2500000 : 4000;
  Crossings sum;
  std::uint64_t seed = 21;
  for (const Face& face : {gull_wing(), with_odd_terms(), of_forbes(), violent()})
    compare_with_bisection(face, rays, seed++, "a face", sum);
  EXPECT_GT(sum.hits, rays / 2);
  EXPECT_LE(sum.grazing, 4 * rays / 1000);
  EXPECT_LE(sum.shallow, 4 * rays / 1000);
  EXPECT_GT(sum.misses, rays / 10);
  EXPECT_GT(sum.several, rays / 1000) << "rays that pass through a face more than once are among them";
}

// Blocks accept most hits by bounds of the face; each must be the first.
TEST(FaceShape, BlocksFindTheFirstHit) {
  const int rays = std::getenv("RELIGN_FULL") ? 4000000 : 40000;
  Crossings sum;
  std::uint64_t seed = 5;
  for (const Face& face : {gull_wing(), with_odd_terms(), of_forbes(), violent()}) {
    Prescription lens;
    lens.elements = {{"L1", {face, conic(0, 0)}, {}}};
    lens.elements[0].faces[0].index_after = 1.5;
    lens.elements[0].faces[1].z_mm = 3;
    const Assembly assembly(lens);
    const BackwardPath path = backward_path(assembly, {});
    for (const char* name : {"generic", "avx2", "avx512"})
      if (const BlockKernels* kernels = block_kernels(name))
        compare_blocks(*kernels, path.ops.back(), face, assembly.bounds(0, 0, Apertures::mesh), rays, seed, "a face",
                       sum);
    ++seed;
  }
  EXPECT_GT(sum.in_blocks, 2 * rays);
}

// Checks the bounds of rings against samples of their faces.
TEST(FaceShape, RingsBoundTheFace) {
  for (const Face& face : {gull_wing(), with_odd_terms(), of_forbes(), violent()}) {
    const FaceBounds bounds = bounds_of(face, face.clear_radius_mm);
    const FaceRings& rings = *bounds.rings;
    Random random(11);
    const auto ring_of = [&](double r) { return std::min(kRings - 1, static_cast<int>(r / bounds.radius * kRings)); };
    for (int i = 0; i < 20000; ++i) {
      const double r = bounds.radius * random.uniform(), other = bounds.radius * random.uniform();
      const int ring = ring_of(r);
      ASSERT_GE(sag(face, r), rings.lowest[ring]);
      ASSERT_LE(sag(face, r), rings.highest[ring]);
      const double step = 1e-4 * bounds.radius;
      const double ahead = std::min(r + step, bounds.radius), back = std::max(r - step, 0.0);
      const double along = std::fabs(slope(face, ahead) - slope(face, back)) / (ahead - back);
      ASSERT_LE(along, rings.most_bent[ring] * 1.001);
      ASSERT_LE(std::fabs(slope(face, r)) / std::max(r, step), rings.most_bent[ring]);
      const double rise = (sag(face, other) - sag(face, r)) / std::fabs(other - r);
      ASSERT_LE(rise, static_cast<double>(other > r ? rings.rise_outside[ring] : rings.rise_anywhere[ring]))
          << "from " << r << " to " << other;
    }
  }
}

// Forbes's first terms, as he prints them: Q_0 = 1, Q_1 = (13 - 16 x) / sqrt(19), Q_2 = sqrt(2 / 95) (29 - 4 x (25 - 19
// x)) of the mild ones; 1, -(5 - 6 x), 15 - 14 x (3 - 2 x) of the strong ones, x = u^2.
TEST(FaceShape, ConvertsForbesPolynomials) {
  const double radius = 2.5;
  Face mild;
  mild.curvature = 0.1;
  mild.over_root = over_root_terms_of_q_bfs({0.3, -0.2, 0.1}, radius);
  Face strong;
  strong.even_asphere = even_terms_of_q_con({0.3, -0.2, 0.1}, radius);
  for (double r = 0.1; r < radius; r += 0.3) {
    const double x = r * r / (radius * radius), c = mild.curvature;
    const double root = std::sqrt(1 - c * c * r * r);
    const double q =
        0.3 - 0.2 * (13 - 16 * x) / std::sqrt(19.0) + 0.1 * std::sqrt(2.0 / 95) * (29 - 4 * x * (25 - 19 * x));
    EXPECT_NEAR(sag(mild, r), c * r * r / (1 + root) + x * (1 - x) / root * q, 1e-14);
    EXPECT_NEAR(sag(strong, r), x * x * (0.3 + 0.2 * (5 - 6 * x) + 0.1 * (15 - 14 * x * (3 - 2 * x))), 1e-14);
  }
}

// A vendor's aspheric condenser (Thorlabs ASL5040-UV: R = 17.37 mm, k = -0.676, radius of the terms 27 mm, fused silica
// 29.85 mm thick), which focuses 405 nm 19.687 mm behind its plane back. With Forbes's factor on the conic all rays
// converge there; without it they miss by 0.2 mm, which shows that design programs use it.
TEST(FaceShape, QbfsOnConicFocusesVendorLens) {
  const double c = 0.05756078762782423, k = -0.6760912064040793, index = 1.4695918;
  const auto over_root =
      over_root_terms_of_q_bfs({-0.8148370167576, -0.32311, 0.10591, -0.05058, 0.00987, -0.0022}, 27);
  const auto focus = [&](const Face& face, double r) {
    const double z = sag(face, r), m = slope(face, r), cosine = 1 / std::sqrt(1 + m * m), ratio = 1 / index;
    const double behind = std::sqrt(1 - ratio * ratio * (1 - cosine * cosine)) - ratio * cosine;
    const double y = -behind * m * cosine, along = ratio + behind * cosine;  // direction in the glass
    const double sine = index * y;
    return -(r + y / along * (29.85 - z)) * std::sqrt(1 - sine * sine) / sine;
  };
  Face plain, made;
  plain.curvature = made.curvature = c;
  plain.conic = made.conic = k;
  plain.over_root = over_root;
  const auto terms = over_root_terms_on_conic(over_root, c, k, 27);
  ASSERT_TRUE(terms.has_value());
  made.over_root = *terms;
  double worst = 0;
  for (const double r : {2.0, 8.0, 14.0, 20.0, 22.86}) {
    EXPECT_NEAR(focus(made, r), 19.687, 1e-3) << r;
    worst = std::max(worst, std::fabs(focus(plain, r) - 19.687));
    double exact = 0;
    for (std::size_t i = over_root.size(); i-- > 0;) exact = (exact + over_root[i]) * r * r;
    exact *= std::sqrt((1 - k * c * c * r * r) / (1 - (1 + k) * c * c * r * r));
    const double root = std::sqrt(1 - (1 + k) * c * c * r * r);
    EXPECT_NEAR(sag(made, r) - c * r * r / (1 + root), exact, 1.01e-6) << r;
  }
  EXPECT_GT(worst, 0.1);
}

// First order depends on the curvature at the vertex, whatever terms it is made of.
TEST(FaceShape, FirstOrderIncludesR2Term) {
  Prescription lens = body(conic(20, 0), conic(0, 0), 1.5);
  const double focal_length = first_order(lens).focal_length;
  Face& front = lens.elements[0].faces[0];
  front.curvature = 0.02;
  front.r2_term = 0.015;
  EXPECT_NEAR(first_order(lens).focal_length, focal_length, 1e-12);
}

}  // namespace
}  // namespace relign::optics
