#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "statistics/curves.h"

namespace relign::statistics {
namespace {

// Expected values: numpy.quantile(values, [0.25, 0.5, 0.75]) and numpy.mean, NumPy 2.
TEST(Quantiles, MatchNumPy) {
  const Quantiles ten = quantiles({3.5, -1, 2, 7, 0.25, 4, 4, 9.5, 1e-3, 2.5});
  EXPECT_EQ(ten.n, 10U);
  EXPECT_DOUBLE_EQ(ten.q25, 0.6875);
  EXPECT_DOUBLE_EQ(ten.median, 3.0);
  EXPECT_DOUBLE_EQ(ten.q75, 4.0);
  EXPECT_DOUBLE_EQ(ten.mean, 3.1751);
  const Quantiles three = quantiles({0.3, 0.1, 0.2});
  EXPECT_DOUBLE_EQ(three.q25, 0.15000000000000002);
  EXPECT_DOUBLE_EQ(three.median, 0.2);
  EXPECT_DOUBLE_EQ(three.q75, 0.25);
  const Quantiles four = quantiles({0.1, 0.2, 0.4, 0.8});
  EXPECT_DOUBLE_EQ(four.q25, 0.17500000000000002);
  EXPECT_DOUBLE_EQ(four.median, 0.30000000000000004);
  EXPECT_DOUBLE_EQ(four.q75, 0.5);
}

TEST(Quantiles, OfOneValueEqualIt) {
  const Quantiles one = quantiles({0.7});
  EXPECT_EQ(one.n, 1U);
  EXPECT_EQ(one.median, 0.7);
  EXPECT_EQ(one.q25, 0.7);
  EXPECT_EQ(one.q75, 0.7);
  EXPECT_EQ(one.mean, 0.7);
}

TEST(Quantiles, SkipNaN) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Quantiles two = quantiles({nan, 1, nan, 3});
  EXPECT_EQ(two.n, 2U);
  EXPECT_EQ(two.median, 2);
  for (const Quantiles& none : {quantiles({}), quantiles({nan})}) {
    EXPECT_EQ(none.n, 0U);
    EXPECT_TRUE(std::isnan(none.median) && std::isnan(none.q25) && std::isnan(none.q75) && std::isnan(none.mean));
  }
}

TEST(Quantiles, AreIndependentOfTheOrder) {
  EXPECT_EQ(quantiles({1e16, 1, -1e16, 1}).mean, quantiles({1, 1, 1e16, -1e16}).mean);
}

}  // namespace
}  // namespace relign::statistics
