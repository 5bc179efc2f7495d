#include "policies/picture.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

namespace relign::policies {
namespace {

struct Picture {
  Picture(std::uint32_t width, std::uint32_t height) : pixels(std::size_t{width} * height) {
    std::iota(pixels.begin(), pixels.end(), 0.0F);
    image = {sizeof image, RELIGN_SAMPLE_FLOAT32, width, height, 1, 0, pixels.data(), width * sizeof(float)};
  }
  std::vector<float> pixels;
  relign_image image;
};

TEST(Resampled, AveragesWholeBlocks) {
  const Picture picture(4, 4);
  EXPECT_EQ(resampled(ImageView(picture.image), 2), (std::vector<float>{2.5F, 4.5F, 10.5F, 12.5F}));
  EXPECT_EQ(resampled(ImageView(picture.image), 4), picture.pixels);
}

TEST(Resampled, SplitsBorderPixelsByArea) {
  const Picture picture(3, 1);  // 0 1 2
  const std::vector<float> halves = resampled(ImageView(picture.image), 2);
  ASSERT_EQ(halves.size(), 4u);
  EXPECT_NEAR(halves[0], (0 + 0.5 * 1) / 1.5, 1e-6);
  EXPECT_NEAR(halves[1], (0.5 * 1 + 2) / 1.5, 1e-6);
  EXPECT_EQ(halves[2], halves[0]);
}

TEST(Resampled, PreservesMean) {
  const Picture picture(40, 30);
  for (const int columns : {7, 10, 100}) {
    const std::vector<float> means = resampled(ImageView(picture.image), columns);
    const double mean = std::accumulate(means.begin(), means.end(), 0.0) / static_cast<double>(means.size());
    EXPECT_NEAR(mean, 599.5, 0.01) << columns;
  }
}

TEST(ToBytes, RoundsAndClamps) {
  std::vector<float> picture = {
      0.0F, 0.1F, 0.3F, 5.0F, -1.0F, 0.00059F, 0.00058F, std::nanf(""), std::numeric_limits<float>::infinity()};
  to_bytes(picture, 0.1, 3);
  EXPECT_EQ(picture, (std::vector<float>{0, 85, 255, 255, 0, 1, 0, 0, 255}));
}

}  // namespace
}  // namespace relign::policies
