#include "optics/rigid.h"

#include <gtest/gtest.h>

#include <cmath>

namespace relign::optics {
namespace {

TEST(Rigid, RotatesRightHanded) {
  // A quarter turn about x takes y to z; about y takes z to x.
  const Vec3 z = turn(rotation_of_degrees(90, 0), {0, 1, 0});
  EXPECT_NEAR(z.z, 1, 1e-15);
  const Vec3 x = turn(rotation_of_degrees(0, 90), {0, 0, 1});
  EXPECT_NEAR(x.x, 1, 1e-15);
  // Rx Ry: the turn about y comes first.
  const Vec3 both = turn(rotation_of_degrees(90, 90), {0, 0, 1});
  EXPECT_NEAR(both.x, 1, 1e-15);
}

TEST(Rigid, InverseUndoesMotion) {
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
