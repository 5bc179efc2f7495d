// RMSE against values calculated by hand.
#include "images/score.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace relign::images {
namespace {

TEST(Rmse, MatchesHandCalculation) {
  const float a[] = {0, 1, 2, 3, 4};
  const float b[] = {0, 1, 4, 3, 3};
  EXPECT_EQ(rmse(a, a, 5), 0);
  EXPECT_EQ(rmse(a, b, 5), 1) << "sqrt((4 + 1) / 5)";
  EXPECT_EQ(rmse(a, b, 2), 0);
  EXPECT_DOUBLE_EQ(rmse(a, b, 3), std::sqrt(4.0 / 3));
  EXPECT_EQ(rmse(b, a, 5), rmse(a, b, 5));
}

TEST(Rmse, ResolvesSmallDifferencesOfLargeImages) {
  // A million pixels that differ by 2^-10: a sum in float would lose the last of them.
  const std::vector<float> a(1'000'000, 1.0F), b(1'000'000, 1.0F + 0x1p-10F);
  EXPECT_DOUBLE_EQ(rmse(a.data(), b.data(), a.size()), 0x1p-10);
}

TEST(Rmse, IsNanForNanPixels) {
  const float a[] = {0, 0}, b[] = {0, std::nanf("")};
  EXPECT_TRUE(std::isnan(rmse(a, b, 2)));
}

}  // namespace
}  // namespace relign::images
