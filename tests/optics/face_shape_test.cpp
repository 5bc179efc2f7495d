// Conics and aspheres against what is known of them without tracing.
#include "optics/face_shape.h"

#include <gtest/gtest.h>

#include <cmath>
#include <relign/random.hpp>

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

// Collimated light leaving glass through a hyperboloid, k = -n^2, meets in one point (Descartes).
TEST(FaceShape, AHyperboloidFocusesPerfectly) {
  const double n = 1.7;
  Prescription lens = body(conic(0, 0), conic(-8, -n * n), n);
  lens.image_z_mm = 10 + first_order(lens).back_focal_length;
  EXPECT_LT(worst_height_at_image(lens), 1e-12);
  lens.elements[0].faces[1].conic = 0;
  EXPECT_GT(worst_height_at_image(lens), 0.01) << "a sphere does not";
}

// Collimated light entering glass through an ellipsoid, k = -1 / n^2, meets at its far focus: outside with a
// concentric sphere behind.
TEST(FaceShape, AnEllipsoidFocusesPerfectly) {
  const double n = 1.6, radius = 9;
  const double focus = radius * n / (n - 1);
  const double back = focus - 10;
  Prescription lens = body(conic(radius, -1 / (n * n)), conic(back, 0), n);
  lens.image_z_mm = focus;
  EXPECT_LT(worst_height_at_image(lens), 1e-12);
}

// A sphere is a paraboloid and c^3 r^4 / 8 + c^5 r^6 / 16 + ...: the same rays to what the series leaves.
TEST(FaceShape, APolynomialSaysASphere) {
  Prescription polynomial = relign_od();
  double largest = 0;
  for (Element& element : polynomial.elements)
    for (Face& face : element.faces) {
      const double c = face.curvature;
      face.conic = -1;
      face.even_asphere.clear();
      double term = c / 2;  // binomial series of (1 - sqrt(1 - c^2 r^2)) / c
      for (std::size_t i = 2; i < 2 + kMostEvenTerms; ++i) {
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

// The point lies on the face, and the normal is the gradient there, whichever way the ray goes.
TEST(FaceShape, PointsLieOnTheFace) {
  Random random(8);
  for (const Element& element : aspheric_relign_od().elements)
    for (const Face& face : element.faces)
      for (int i = 0; i < 50; ++i) {
        const double way = i % 2 == 0 ? 1 : -1;
        const Vec3 l = unit({random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4), way});
        const Vec3 through{random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5), 0};
        const auto met = meet(face, bounds_of(face, sound_radius(face)), through - 30 * l, l);
        ASSERT_TRUE(met);
        const double r = std::hypot(met->at.x, met->at.y);
        EXPECT_NEAR(met->at.z, sag(face, r), 1e-11);
        const double step = 1e-5;
        const double slope = (sag(face, r + step) - sag(face, r - step)) / (2 * step);
        EXPECT_NEAR(-(met->normal.x * met->at.x + met->normal.y * met->at.y) / met->normal.z, slope * r, 1e-7);
        EXPECT_NEAR(dot(met->normal, met->normal), 1, 1e-14);
      }
}

TEST(FaceShape, MissesWhatIsNotThere) {
  EXPECT_FALSE(meet(conic(3, 0), {}, {0, 3.1, -1}, {0, 0, 1}));
  EXPECT_TRUE(meet(conic(3, 0), {}, {0, 2.9, -1}, {0, 0, 1}));
  EXPECT_TRUE(meet(conic(3, -1), {}, {0, 3.1, -1}, {0, 0, 1})) << "a paraboloid goes on";
  EXPECT_FALSE(meet(conic(3, 1), {}, {0, 2.9, -1}, {0, 0, 1})) << "an oblate ellipsoid ends before";
  Face bent = conic(3, 0);
  bent.even_asphere = {1e-3};
  EXPECT_FALSE(meet(bent, bounds_of(bent, sound_radius(bent)), {0, 3.1, -1}, {0, 0, 1}));
}

}  // namespace
}  // namespace relign::optics
