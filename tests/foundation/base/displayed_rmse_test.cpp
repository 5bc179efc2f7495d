#include "base/displayed_rmse.h"

#include <gtest/gtest.h>

#include <limits>

namespace relign {
namespace {

TEST(DisplayedRmse, ClipsNegativeMse) {
  EXPECT_EQ(displayed_rmse(0.25), 0.5);
  EXPECT_EQ(displayed_rmse(0), 0);
  EXPECT_FALSE(std::signbit(displayed_rmse(-0.0)));
  EXPECT_EQ(displayed_rmse(-1e-7), 0);
}

TEST(DisplayedRmse, IsNanForUnknownMse) {
  EXPECT_TRUE(std::isnan(displayed_rmse(std::numeric_limits<double>::quiet_NaN())));
}

}  // namespace
}  // namespace relign
