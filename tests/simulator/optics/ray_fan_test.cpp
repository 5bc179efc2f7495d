// Ray fans extend from rim to rim: every ray between passes, slightly beyond they are lost.
#include "optics/ray_fan.h"

#include <gtest/gtest.h>

#include <cmath>

#include "optics/lens_under_test.h"

namespace relign::optics {
namespace {

// The last ray, shifted outwards by the fraction `by` of the fan's width.
TracedRay beyond(const Assembly& assembly, const FanRay& inner, const FanRay& rim, double by) {
  Ray ray = rim.start;
  ray.start = ray.start + by * (rim.start.start - inner.start.start);
  ray.direction = ray.direction + by * (rim.start.direction - inner.start.direction);
  return trace(assembly, ray, Apertures::mesh);
}

TEST(RayFan, FillsTheLensFromRimToRim) {
  const Assembly perfect(relign_od());
  const Assembly tilted(relign_od(), {{"L3", {{0.1, -0.1, 0}, {3, 2}}}});
  for (const Assembly* assembly : {&perfect, &tilted})
    for (const double field : {-30.0, 0.0, 20.0, 42.0})
      for (const std::optional<double> object : {std::optional<double>(), std::optional<double>(-132.0)}) {
        const std::vector<FanRay> fan = ray_fan(*assembly, field, object, 7);
        ASSERT_EQ(fan.size(), 7U) << field;
        for (const FanRay& ray : fan) EXPECT_TRUE(ray.traced.passed);
        EXPECT_FALSE(beyond(*assembly, fan.back(), fan.front(), 1e-6).passed) << field;
        EXPECT_FALSE(beyond(*assembly, fan.front(), fan.back(), 1e-6).passed) << field;
      }
}

TEST(RayFan, AxialRaysFillTheApertureStop) {
  const Assembly assembly(relign_od());
  const std::vector<FanRay> fan = ray_fan(assembly, 0, {}, 2);
  ASSERT_EQ(fan.size(), 2U);
  // The stop limits light on the axis; it is between L1's back and L2's front.
  for (const FanRay& ray : fan) {
    const Vec3 &before = ray.traced.hits[1], &behind = ray.traced.hits[2];
    const double share = (relign_od().aperture_stop().z_mm - before.z) / (behind.z - before.z);
    EXPECT_NEAR(std::fabs(before.y + share * (behind.y - before.y)), relign_od().aperture_stop().opening_radius_mm,
                1e-9);
  }
}

TEST(RayFan, StartsAtTheObjectPoint) {
  const Assembly assembly(relign_od());
  const std::vector<FanRay> fan = ray_fan(assembly, 20, -100, 5);
  ASSERT_EQ(fan.size(), 5U);
  for (const FanRay& ray : fan) {
    EXPECT_EQ(ray.start.start.z, -100);
    EXPECT_NEAR(ray.start.start.y, -std::tan(20 * M_PI / 180) * (100 + 5.8206), 1e-3);  // published pupil
    EXPECT_GT(ray.traced.image.y, 0);
  }
  // A single ray is between the rims.
  const std::vector<FanRay> one = ray_fan(assembly, 20, -100, 1);
  ASSERT_EQ(one.size(), 1U);
  EXPECT_GT(one[0].start.direction.y, fan.front().start.direction.y);
  EXPECT_LT(one[0].start.direction.y, fan.back().start.direction.y);
}

TEST(RayFan, IsEmptyWhereNothingPasses) {
  EXPECT_TRUE(ray_fan(Assembly(relign_od()), 80, {}, 7).empty());
  EXPECT_TRUE(ray_fan(Assembly(relign_od(), {{"L2", {{0, 30, 0}, {0, 0}}}}), 0, {}, 7).empty());
}

}  // namespace
}  // namespace relign::optics
