#include <gtest/gtest.h>

#include <limits>
#include <relign/random.hpp>
#include <stdexcept>

#include "least_squares/binning.hpp"
#include "least_squares/learnt_once.hpp"
#include "least_squares/nominal_pose.hpp"
#include "least_squares/nuisance.hpp"

namespace {

struct Ramp {
  float at(std::size_t x, std::size_t y) const { return static_cast<float>(10 * y + x); }
};

TEST(Pictures, BinsLargeImagesToMeans) {
  const least_squares::Binning binning(7, 5, 3);  // 2 x 1 squares of 3 pixels a side, the rest is dropped
  EXPECT_EQ(binning.bin(), 3u);
  const Eigen::VectorXf binned = binning(Ramp{});
  ASSERT_EQ(binned.size(), 2);
  EXPECT_FLOAT_EQ(binned[0], 11);  // the middle of 0..22
  EXPECT_FLOAT_EQ(binned[1], 14);
  EXPECT_EQ(least_squares::Binning(3, 2, 3).bin(), 1u);
}

TEST(Pictures, CountsNonFinitePixelsAsDark) {
  struct Broken {
    float at(std::size_t x, std::size_t) const {
      return x == 0 ? std::numeric_limits<float>::quiet_NaN() : x == 1 ? 1e30F : 2;
    }
  };
  EXPECT_EQ(least_squares::Binning(3, 1, 3)(Broken{}), Eigen::Vector3f(0, 0, 2));
}

TEST(Pictures, BlurHasUnitSumZeroShiftAndGivenWidth) {
  const Eigen::Index width = 41, height = 31;
  Eigen::VectorXf point = Eigen::VectorXf::Zero(width * height);
  point[12 * width + 20] = 1;
  const Eigen::VectorXf blurred = least_squares::blurred(point, width, height, 2);
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
  EXPECT_EQ(least_squares::blurred(point, width, height, 0), point);
}

TEST(Pictures, BlurTreatsPixelsBeyondTheEdgeAsDark) {
  const Eigen::VectorXf blurred = least_squares::blurred(Eigen::VectorXf::Ones(20), 20, 1, 1.5);
  EXPECT_NEAR(blurred[10], blurred[9], 1e-6);
  EXPECT_LT(blurred[0], 0.7F * blurred[10]);
}

TEST(Pictures, AveragesSquares) {
  const Eigen::VectorXf picture = Eigen::VectorXf::LinSpaced(5 * 2, 0, 9);
  EXPECT_EQ(least_squares::means_over_squares(picture, 5, 2, 2), Eigen::Vector2f(3, 5));
}

TEST(Nuisance, RemovesGainOffsetStrayLightAndSmoothFields) {
  constexpr Eigen::Index kWidth = 20, kHeight = 16, kPixels = kWidth * kHeight;
  relign::Random random(3);
  const auto noise = [&](float scale) -> Eigen::VectorXf {
    return scale * Eigen::VectorXf::NullaryExpr(kPixels, [&] { return static_cast<float>(random.normal()); });
  };
  const Eigen::VectorXf image = Eigen::VectorXf::Ones(kPixels) + noise(0.3F), stray = 0.1F * noise(1);
  const Eigen::MatrixXf fields = least_squares::smooth_fields(kWidth, kHeight, 2);
  ASSERT_EQ(fields.cols(), 5);
  EXPECT_LT(fields.colwise().sum().cwiseAbs().maxCoeff(), 1e-3) << "no constant";
  EXPECT_FLOAT_EQ(fields(kWidth, 0), std::cos(3.14159265F * 1.5F / kHeight)) << "row 1 of the field along y";
  const least_squares::Nuisance<float> nuisance(image, stray, {kWidth, kHeight, 2}, 1e-6);
  const Eigen::VectorXf disturbance =
      -0.1F * image + Eigen::VectorXf::Constant(kPixels, 0.05F) + 0.4F * stray + 0.03F * fields.col(3);
  EXPECT_LT(nuisance.without(disturbance).norm(), 1e-3F * disturbance.norm());
  EXPECT_NEAR(nuisance.fit(disturbance).explained / disturbance.squaredNorm(), 1, 1e-3);
  EXPECT_NEAR(nuisance.fit(disturbance).gain, 0.9, 1e-3);
  const Eigen::VectorXf other = noise(0.01F), kept = nuisance.without(other);
  EXPECT_NEAR(kept.squaredNorm() / other.squaredNorm(), 1 - 8.0 / kPixels, 0.05) << "eight directions of 320";
  EXPECT_NEAR(nuisance.fit(other).explained, other.squaredNorm() - other.dot(kept), 1e-6);
  EXPECT_LT((nuisance.whitened(nuisance.whitened(other)) - kept).norm(), 1e-4F * kept.norm()) << "a square root of W";
}

TEST(Nuisance, KeepsFieldsFarBelowTheNoise) {
  const Eigen::VectorXf image = Eigen::VectorXf::Ones(64);
  const least_squares::Nuisance<float> nuisance(image, {}, {8, 8, 2}, 1e4);
  EXPECT_LT((nuisance.without(image) - image).norm(), 0.01F * image.norm());
  EXPECT_EQ(least_squares::Nuisance<float>().without(image), image);
  EXPECT_EQ(least_squares::Nuisance<float>(0 * image, {}, {8, 8, 2}, 0).without(image), image) << "a dark image";
}

TEST(NominalPose, DefaultsToTheMiddleOfEachAxis) {
  using least_squares::nominal_pose;
  EXPECT_EQ(nominal_pose(R"({"nominal_pose": [0.25, null]})", 2), Eigen::Vector2d(0.25, 0.5));
  for (const char* scene : {"{}", "[]", "no JSON", R"({"nominal_pose": "here"})"})
    EXPECT_EQ(nominal_pose(scene, 2), Eigen::Vector2d(0.5, 0.5)) << scene;
  EXPECT_THROW(nominal_pose(R"({"nominal_pose": [0.25]})", 2), std::runtime_error);
}

TEST(LearntOnce, CachesPerOriginAndNotFailures) {
  least_squares::LearntOnce<int> kept(4);
  int times = 0;
  const auto learn = [&] {
    if (++times == 1) throw std::runtime_error("no");
    return times;
  };
  const auto of = [](const char* text) { return least_squares::Origin().add(text); };
  EXPECT_THROW(kept(of("a"), learn), std::runtime_error);
  EXPECT_EQ(*kept(of("a"), learn), 2);
  EXPECT_EQ(*kept(of("a"), learn), 2);
  const auto mine = kept(of("b"), learn);
  EXPECT_EQ(*mine, 3);
  for (const char* other : {"c", "d", "e", "f"}) kept(of(other), learn);
  EXPECT_EQ(*kept(of("a"), learn), 8);  // evicted: only the last few are kept
  EXPECT_EQ(*mine, 3);                  // an evicted entry stays valid for its owners
}

TEST(LearntOnce, OriginsCompareInFull) {
  using least_squares::Origin;
  EXPECT_TRUE(Origin().add("ab").add(0.5) == Origin().add("ab").add(0.5));
  EXPECT_FALSE(Origin().add("ab").add("c") == Origin().add("a").add("bc"));
  EXPECT_FALSE(Origin().add(0.5) == Origin().add(0.5 + 1e-15));
  EXPECT_FALSE(Origin().add(std::vector<float>{1, 2}) == Origin().add(std::vector<float>{1, 3}));
}

}  // namespace
