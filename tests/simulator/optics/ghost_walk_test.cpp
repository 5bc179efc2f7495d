// GhostWalk: refraction at every face equals the sequential trace; reflections obey the law; stops absorb.
#include "optics/ghost_walk.h"

#include <gtest/gtest.h>

#include <cmath>

#include "lens_under_test.h"
#include "optics/trace.h"

namespace relign::optics {
namespace {

using Next = GhostWalk::Next;

double distance(const Vec3& a, const Vec3& b) { return std::sqrt(dot(a - b, a - b)); }

TEST(GhostWalk, MatchesSequentialTraceWithoutReflections) {
  const Prescription& lens = relign_od();
  const Assembly assembly(lens, {{"L2", {{0.01, -0.02, 0.005}, {0.3, -0.2}}}, {"L4", {{0, 0.01, 0}, {-0.4, 0.1}}}});
  GhostWalk walk;
  walk.set(assembly);
  int compared = 0;
  for (int field = -30; field <= 30; field += 10)
    for (int height = -2; height <= 2; ++height) {
      const double tangent = std::tan(field * 3.14159265358979 / 180);
      const Vec3 direction = unit({0.02, tangent, 1});
      const TracedRay forward = trace(assembly, {{0.1, 0.2 * height - 6 * tangent, -0.5}, direction}, Apertures::mesh);
      if (!forward.passed) continue;
      ++compared;
      WalkingRay ray;
      ASSERT_TRUE(walk.enter_from_image(forward.image, -1.0 * forward.exit_direction, ray));
      AtFace met;
      for (std::size_t face = forward.hits.size(); face-- > 0;) {
        ASSERT_EQ(walk.advance(ray, met), Next::face);
        ASSERT_FALSE(met.is_edge);
        EXPECT_LT(distance(met.at, forward.hits[face]), 1e-9);
        walk.refract(met, ray);
      }
      EXPECT_EQ(walk.advance(ray, met), Next::object_side);
      EXPECT_LT(distance(ray.direction, -1.0 * direction), 1e-10);
    }
  EXPECT_GT(compared, 10);
}

// Normal incidence: reflectance ((n - 1) / (n + 1))^2 at every face; a ray on the axis returns on its path.
TEST(GhostWalk, ReflectsOnTheAxis) {
  const Prescription& lens = relign_od();
  GhostWalk walk;
  walk.set(Assembly(lens));
  WalkingRay ray;
  ASSERT_TRUE(walk.enter_from_image({0, 0, 20}, {0, 0, -1}, ray));
  AtFace met;
  ASSERT_EQ(walk.advance(ray, met), Next::face);
  const double n = lens.elements[3].faces[0].index_after;
  EXPECT_NEAR(met.reflectance, std::pow((n - 1) / (n + 1), 2), 1e-12);
  walk.refract(met, ray);
  ASSERT_EQ(walk.advance(ray, met), Next::face);
  EXPECT_NEAR(met.reflectance, std::pow((n - 1) / (n + 1), 2), 1e-12);
  walk.reflect(met, ray);
  ASSERT_EQ(walk.advance(ray, met), Next::face);
  EXPECT_NEAR(met.at.z, 17.141761, 1e-12);
  walk.refract(met, ray);
  EXPECT_EQ(walk.advance(ray, met), Next::image_side);
  EXPECT_NEAR(ray.direction.z, 1, 1e-15);
}

// L1's back is nearly a hemisphere: a grazing ray hits its concave side again before it leaves.
TEST(GhostWalk, HitsConcaveFaceTwice) {
  const Prescription& lens = relign_od();
  GhostWalk walk;
  walk.set(Assembly(lens));
  const double radius = 2.95545, centre = 1.5 + radius;
  WalkingRay ray{{2.6, 0, 6}, {0, 0, -1}, 3, 0, false, -1};
  AtFace met;
  ASSERT_EQ(walk.advance(ray, met), Next::face);
  for (int bounce = 0; bounce < 2; ++bounce) {
    EXPECT_EQ(met.surface, 1) << "bounce " << bounce;
    EXPECT_NEAR(distance(met.at, {0, 0, centre}), radius, 1e-10);
    walk.reflect(met, ray);
    ASSERT_EQ(walk.advance(ray, met), Next::face);
  }
  EXPECT_LT(met.at.x, 0) << "on the other side of the axis";
}

TEST(GhostWalk, StopsAndBarrelAbsorb) {
  const Prescription& lens = relign_od();
  GhostWalk walk;
  walk.set(Assembly(lens));
  AtFace met;
  // Between aperture stop and L1, slightly too high for the front stop, which is within the depth of L1's concave back.
  WalkingRay at_stop{{2.775, 0, 8}, {0, 0, -1}, 3, 0, false, -1};
  EXPECT_EQ(walk.advance(at_stop, met), Next::lost);
  // Higher, the stop is inside L1's glass.
  WalkingRay behind_glass{{3.2, 0, 8}, {0, 0, -1}, 3, 0, false, -1};
  ASSERT_EQ(walk.advance(behind_glass, met), Next::face);
  EXPECT_TRUE(met.is_edge);
  walk.refract(met, behind_glass);
  EXPECT_EQ(walk.advance(behind_glass, met), Next::lost);
  // Beside L4, towards the bore.
  WalkingRay at_bore{{3.5, 0, 18}, unit({1, 0, -1}), -1, 0, false, -1};
  EXPECT_EQ(walk.advance(at_bore, met), Next::lost);
  // From outside of the bore at the rear.
  WalkingRay ray;
  EXPECT_FALSE(walk.enter_from_image({5.2, 0, 20.7}, {0, 0, -1}, ray));
}

// A ray outside the clear aperture hits the ring at L4's rim and enters the glass there.
TEST(GhostWalk, EdgesRefract) {
  const Prescription& lens = relign_od();
  GhostWalk walk;
  walk.set(Assembly(lens));
  WalkingRay ray;
  ASSERT_TRUE(walk.enter_from_image({3.0, 0, 20}, {0, 0, -1}, ray));
  AtFace met;
  ASSERT_EQ(walk.advance(ray, met), Next::face);
  EXPECT_TRUE(met.is_edge);
  EXPECT_NEAR(met.at.z, 17.4875, 1e-3);
  walk.refract(met, ray);
  EXPECT_GT(ray.glass, 0);
  ASSERT_EQ(walk.advance(ray, met), Next::face);
  EXPECT_NEAR(dot(ray.direction, ray.direction), 1, 1e-12);
}

}  // namespace
}  // namespace relign::optics
