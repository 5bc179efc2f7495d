// Image measures against images whose values are known analytically.
#include "images/measures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <relign/random.hpp>

namespace relign::images {
namespace {

constexpr double kPi = 3.14159265358979323846;

template <class Light>
Image painted(std::size_t width, std::size_t height, Light&& light) {
  Image image(width, height);
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x < width; ++x)
      image.at(x, y) = static_cast<float>(light(static_cast<double>(x), static_cast<double>(y)));
  return image;
}

Image gaussian_spot(double x0, double y0, double sigma, double background = 0) {
  return painted(80, 60, [=](double x, double y) {
    return background + std::exp(-((x - x0) * (x - x0) + (y - y0) * (y - y0)) / (2 * sigma * sigma));
  });
}

// A step from 0.1 to 0.9 across a line through the centre, slanted by `degrees`, blurred by a Gaussian.
Image blurred_edge(std::size_t size, double degrees, double sigma) {
  const double angle = degrees * kPi / 180, middle = static_cast<double>(size) / 2 - 0.3;
  return painted(size, size, [=](double x, double y) {
    const double distance = (x - middle) * std::cos(angle) + (y - middle) * std::sin(angle);
    return 0.5 + 0.4 * std::erf(distance / (sigma * std::sqrt(2.0)));
  });
}

double gaussian_mtf(double sigma, double f) { return std::exp(-2 * kPi * kPi * sigma * sigma * f * f); }

Region whole(const Image& image) { return {0, 0, image.width, image.height}; }

TEST(MeanAndContrast, MatchHandCalculation) {
  const Image image = painted(4, 2, [](double x, double) { return x < 2 ? 1.0 : 3.0; });
  EXPECT_DOUBLE_EQ(mean(image), 2);
  EXPECT_DOUBLE_EQ(contrast(image), 0.5);
  EXPECT_TRUE(std::isnan(contrast(Image(4, 4, 0.0F)))) << "no light";
}

TEST(Contrast, OfGratingIsModulationOverRootTwo) {
  const Image grating = painted(160, 20, [](double x, double) { return 0.3 * (1 + 0.6 * std::sin(2 * kPi * x / 16)); });
  EXPECT_NEAR(contrast(grating), 0.6 / std::sqrt(2.0), 1e-6);
}

TEST(Sharpness, OfRampIsSquaredSlopeOverSquaredLevel) {
  const Image ramp = painted(41, 30, [](double x, double y) { return 1 + 0.02 * (x - 20) + 0.01 * (y - 14.5); });
  EXPECT_NEAR(sharpness(ramp), 0.02 * 0.02 + 0.01 * 0.01, 1e-8);
  Image brighter = ramp;
  for (float& value : brighter.values) value *= 8;
  EXPECT_DOUBLE_EQ(sharpness(brighter), sharpness(ramp)) << "independent of the light level";
}

TEST(Sharpness, DecreasesWithBlur) {
  double before = 1e9;
  for (const double sigma : {0.7, 1.0, 1.5, 2.5, 4.0}) {
    const double now = sharpness(blurred_edge(64, 5, sigma));
    EXPECT_LT(now, before) << sigma;
    before = now;
  }
}

TEST(Moments, LocateShiftedSpotAndItsWidth) {
  for (const double background : {0.0, 0.7}) {
    const Moments found = moments(gaussian_spot(33.37, 24.81, 2.6, background));
    EXPECT_NEAR(found.centroid_x_px, 33.37, 2e-3);
    EXPECT_NEAR(found.centroid_y_px, 24.81, 2e-3);
    EXPECT_NEAR(found.width_px, 2.6, 5e-3);
  }
}

TEST(Moments, LocateDarkSpot) {
  Image image = gaussian_spot(20.25, 31.5, 3);
  for (float& value : image.values) value = 2 - value;
  const Moments found = moments(image);
  EXPECT_NEAR(found.centroid_x_px, 20.25, 2e-3);
  EXPECT_NEAR(found.centroid_y_px, 31.5, 2e-3);
}

TEST(Moments, AreNanForUniformImage) {
  EXPECT_TRUE(std::isnan(moments(Image(20, 20, 0.4F)).centroid_x_px));
  EXPECT_TRUE(std::isnan(moments(Image(20, 20, 0.4F)).width_px));
}

Image star(double x0, double y0, int cycles, double modulation, double phase = 0.3) {
  return painted(200, 200, [=](double x, double y) {
    return 0.25 * (1 + modulation * std::cos(cycles * std::atan2(y - y0, x - x0) + phase));
  });
}

TEST(StarContrast, OfSinusoidalStarIsItsModulation) {
  const Image image = star(101.3, 98.6, 36, 0.62);
  for (const double radius : {30.0, 45.0, 80.0})
    EXPECT_NEAR(star_contrast(image, {101.3, 98.6, radius, 36}), 0.62, 0.002) << radius;
  EXPECT_LT(star_contrast(image, {101.3, 98.6, 60, 24}), 0.02) << "no other number of spokes";
}

TEST(StarContrast, OfBlurredStarMatchesGaussianMtf) {
  // At radius r the star is a grating of frequency f = cycles / (2 pi r), whose modulation a Gaussian blur multiplies
  // by exp(-2 pi^2 sigma^2 f^2). The image is painted with that modulation.
  const double sigma = 1.5;
  const int cycles = 36;
  const Image image = painted(200, 200, [=](double x, double y) {
    const double radius = std::hypot(x - 100, y - 100) + 1e-9;
    return 0.5 *
           (1 + gaussian_mtf(sigma, cycles / (2 * kPi * radius)) * std::cos(cycles * std::atan2(y - 100, x - 100)));
  });
  for (const double radius : {40.0, 60.0, 85.0}) {
    const double expected = gaussian_mtf(sigma, cycles / (2 * kPi * radius));
    EXPECT_NEAR(star_contrast(image, {100, 100, radius, cycles}), expected, 0.01 * expected + 0.002) << radius;
  }
}

TEST(StarContrast, OfBinaryStarIsItsFundamental) {
  const Image image = painted(
      200, 200, [](double x, double y) { return std::cos(12 * std::atan2(y - 99.5, x - 99.5)) > 0 ? 1.0 : 0.0; });
  EXPECT_NEAR(star_contrast(image, {99.5, 99.5, 80, 12}), 4 / kPi, 0.02);
}

TEST(StarContrast, IsNanOutsideTheImageAndBeyondPixelResolution) {
  const Image image = star(100, 100, 36, 0.5);
  EXPECT_TRUE(std::isnan(star_contrast(image, {100, 100, 120, 36})));
  EXPECT_TRUE(std::isnan(star_contrast(image, {100, 100, 3, 36}))) << "36 cycles on 19 pixels";
  EXPECT_TRUE(std::isnan(star_contrast(image, {100, 100, 30, 0})));
  EXPECT_TRUE(std::isnan(star_contrast(image, {std::nan(""), 100, 30, 36})));
  EXPECT_TRUE(std::isnan(star_contrast(Image(200, 200, 0.0F), {100, 100, 30, 36}))) << "no light";
}

TEST(EdgeMtf, MatchesGaussianBlurWithinTwoPercent) {
  for (const double sigma : {0.6, 1.0, 1.8})
    for (const double degrees : {4.0, 8.5, 20.0, -11.0, 86.0, 79.0}) {  // the last two edges are nearly horizontal
      const Image image = blurred_edge(90, degrees, sigma);
      EXPECT_NEAR(edge_mtf(image, whole(image), 0), 1, 1e-12);
      for (const double f : {0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5}) {
        const double expected = gaussian_mtf(sigma, f);
        if (expected < 0.1) continue;
        EXPECT_NEAR(edge_mtf(image, whole(image), f) / expected, 1, 0.02)
            << "sigma " << sigma << " px, " << degrees << " degrees, " << f << " cycles/px";
      }
    }
}

// The same edge seen by square pixels of full fill factor, in a region as of a field.
Image edge_through_pixels(double degrees, double sigma, double noise) {
  const double angle = degrees * kPi / 180, cosine = std::cos(angle), sine = std::sin(angle);
  constexpr int kPoints = 6;  // a side of a pixel
  Random random(7);
  return painted(128, 94, [&](double x, double y) {
    double light = 0;
    for (int i = 0; i < kPoints; ++i)
      for (int j = 0; j < kPoints; ++j) {
        const double dx = x - 63.3 + (i + 0.5) / kPoints - 0.5, dy = y - 46.8 + (j + 0.5) / kPoints - 0.5;
        light += std::erf((dx * cosine + dy * sine) / (sigma * std::sqrt(2.0)));
      }
    return 0.5 + 0.4 * light / (kPoints * kPoints) + noise * random.normal();
  });
}

// Noise in parts of the edge's step.
TEST(EdgeMtf, MatchesBlurTimesPixelAtEveryNoise) {
  const auto sinc = [](double x) { return x == 0 ? 1 : std::sin(kPi * x) / (kPi * x); };
  for (const auto& [noise, within] : {std::pair{0.0, 0.01}, std::pair{0.01, 0.025}, std::pair{0.1, 0.2}}) {
    double largest = 0, squares = 0;
    int count = 0;
    for (const double sigma : {0.4, 0.8, 2.0})
      for (const double degrees : {3.0, 5.0, 9.0, 15.0, -6.0}) {
        const Image image = edge_through_pixels(degrees, sigma, 0.8 * noise);
        for (const double f : {0.0625, 0.125, 0.25, 0.4}) {
          const double cosine = std::cos(degrees * kPi / 180), sine = std::sin(degrees * kPi / 180);
          const double exact = gaussian_mtf(sigma, f) * sinc(f * cosine) * sinc(f * sine);
          const double off = edge_mtf(image, whole(image), f) - exact;
          EXPECT_NEAR(off, 0, within) << sigma << " px, " << degrees << " degrees, " << f << " cycles/px, " << noise;
          largest = std::max(largest, std::fabs(off));
          squares += off * off;
          ++count;
        }
      }
    std::printf("noise %.2f of the step: largest deviation %.4f, rms %.4f\n", noise, largest,
                std::sqrt(squares / count));
  }
}

TEST(EdgeMtf, UsesOnlyItsRegion) {
  Image image(150, 120, 0.3F);
  const Image edge = blurred_edge(60, 7, 1.2);
  for (std::size_t y = 0; y < 60; ++y)
    for (std::size_t x = 0; x < 60; ++x) image.at(70 + x, 40 + y) = edge.at(x, y);
  EXPECT_DOUBLE_EQ(edge_mtf(image, {70, 40, 60, 60}, 0.2), edge_mtf(edge, whole(edge), 0.2));
  EXPECT_TRUE(std::isnan(edge_mtf(image, {100, 40, 60, 60}, 0.2))) << "beyond the image";
}

TEST(EdgeMtf, ToleratesNoise) {
  Image image = blurred_edge(90, 6, 1.2);
  Random random(5);
  for (float& value : image.values) value += static_cast<float>(0.01 * random.normal());
  EXPECT_NEAR(edge_mtf(image, whole(image), 0.1), gaussian_mtf(1.2, 0.1), 0.04);
  EXPECT_NEAR(edge_mtf(image, whole(image), 0.2), gaussian_mtf(1.2, 0.2), 0.04);
}

TEST(EdgeMtf, IsNanWithoutSlantedEdge) {
  const Image even(60, 60, 0.5F);
  EXPECT_TRUE(std::isnan(edge_mtf(even, whole(even), 0.1)));
  const Image straight = blurred_edge(60, 0, 1);
  EXPECT_TRUE(std::isnan(edge_mtf(straight, whole(straight), 0.1)))
      << "an edge along the pixel grid has no finer samples";
  const Image spot = gaussian_spot(40, 30, 3);
  EXPECT_TRUE(std::isnan(edge_mtf(spot, whole(spot), 0.1)));
}

}  // namespace
}  // namespace relign::images
