#include "pictures/pictures.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace {

struct Ramp {
  float at(std::size_t x, std::size_t y) const { return static_cast<float>(10 * y + x); }
};

TEST(Pictures, LargeImagesAreBinnedToMeans) {
  const pictures::Binning binning(7, 5, 3);  // squares of 3: 2 x 1 of them, the rest is cut off
  EXPECT_EQ(binning.bin(), 3u);
  const Eigen::VectorXf binned = binning(Ramp{});
  ASSERT_EQ(binned.size(), 2);
  EXPECT_FLOAT_EQ(binned[0], 11);  // the middle of 0..22
  EXPECT_FLOAT_EQ(binned[1], 14);
  EXPECT_EQ(pictures::Binning(3, 2, 3).bin(), 1u);
}

TEST(Pictures, WhatIsNoNumberIsDark) {
  struct Broken {
    float at(std::size_t x, std::size_t) const {
      return x == 0 ? std::numeric_limits<float>::quiet_NaN() : x == 1 ? 1e30F : 2;
    }
  };
  EXPECT_EQ(pictures::Binning(3, 1, 3)(Broken{}), Eigen::Vector3f(0, 0, 2));
}

TEST(Pictures, BlurKeepsLightPlaceAndWidth) {
  const Eigen::Index width = 41, height = 31;
  Eigen::VectorXf point = Eigen::VectorXf::Zero(width * height);
  point[12 * width + 20] = 1;
  const Eigen::VectorXf blurred = pictures::blurred(point, width, height, 2);
  double light = 0, x_mean = 0, y_mean = 0, x_square = 0;
  for (Eigen::Index y = 0; y < height; ++y)
    for (Eigen::Index x = 0; x < width; ++x) {
      const double pixel = blurred[y * width + x];
      light += pixel;
      x_mean += pixel * static_cast<double>(x);
      y_mean += pixel * static_cast<double>(y);
      x_square += pixel * static_cast<double>((x - 20) * (x - 20));
    }
  EXPECT_NEAR(light, 1, 1e-5);
  EXPECT_NEAR(x_mean, 20, 1e-4);
  EXPECT_NEAR(y_mean, 12, 1e-4);
  EXPECT_NEAR(std::sqrt(x_square), 2, 0.05);  // cut off at 3 sigma
  EXPECT_EQ(pictures::blurred(point, width, height, 0), point);
}

TEST(Pictures, BlurIsDarkBeyondTheEdge) {
  const Eigen::VectorXf blurred = pictures::blurred(Eigen::VectorXf::Ones(20), 20, 1, 1.5);
  EXPECT_NEAR(blurred[10], blurred[9], 1e-6);
  EXPECT_LT(blurred[0], 0.7F * blurred[10]);
}

}  // namespace
