#include "optics/rigid.h"

#include <gtest/gtest.h>

#include <cmath>

namespace relign::optics {
namespace {

TEST(Elementary, SineAndCosineOfDegrees) {
  for (double degrees = -360; degrees <= 360; degrees += 0.37) {
    const SineCosine ours = sine_cosine_of_degrees(degrees);
    const long double x = static_cast<long double>(degrees) * 3.14159265358979323846264338327950288L / 180;
    EXPECT_NEAR(ours.sine, static_cast<double>(std::sin(x)), 4e-16) << degrees;
    EXPECT_NEAR(ours.cosine, static_cast<double>(std::cos(x)), 4e-16) << degrees;
  }
  EXPECT_EQ(sine_cosine_of_degrees(90).sine, 1);
  EXPECT_EQ(sine_cosine_of_degrees(90).cosine, 0);
  EXPECT_EQ(sine_cosine_of_degrees(0).cosine, 1);
}

TEST(Rigid, RightHanded) {
  // A quarter turn about x takes y to z; about y takes z to x.
  const Vec3 z = turn(rotation_of_degrees(90, 0), {0, 1, 0});
  EXPECT_NEAR(z.z, 1, 1e-15);
  const Vec3 x = turn(rotation_of_degrees(0, 90), {0, 0, 1});
  EXPECT_NEAR(x.x, 1, 1e-15);
  // Rx Ry: the turn about y comes first.
  const Vec3 both = turn(rotation_of_degrees(90, 90), {0, 0, 1});
  EXPECT_NEAR(both.x, 1, 1e-15);
}

TEST(Rigid, InverseUndoes) {
  const Motion motion{rotation_of_degrees(12, -34, 5), {1, 2, 3}};
  const Vec3 p{0.3, -4, 7};
  const Vec3 back = inverse(motion).point(motion.point(p));
  EXPECT_NEAR(back.x, p.x, 1e-14);
  EXPECT_NEAR(back.y, p.y, 1e-14);
  EXPECT_NEAR(back.z, p.z, 1e-14);
  const Vec3 same = after(inverse(motion), motion).point(p);
  EXPECT_NEAR(same.z, p.z, 1e-14);
}

}  // namespace
}  // namespace relign::optics
