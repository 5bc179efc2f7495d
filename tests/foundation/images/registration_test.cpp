// Registration of images painted at a known shift and rotation.
#include "images/registration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <relign/random.hpp>

namespace relign::images::registration_tests {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Light at a position relative to the centre of the image, in pixels.
using Chart = std::function<double(double, double)>;

// Point (x, y) of the chart appears at the image's centre + shift + (x, y) rotated clockwise (y points down).
Image shown(const Chart& chart, const Registration& how, std::size_t width = 160, std::size_t height = 120) {
  const double angle = how.rotation_deg * kPi / 180;
  Image image(width, height);
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x < width; ++x) {
      const double dx = static_cast<double>(x) - (static_cast<double>(width) - 1) / 2 - how.shift_x_px;
      const double dy = static_cast<double>(y) - (static_cast<double>(height) - 1) / 2 - how.shift_y_px;
      image.at(x, y) = static_cast<float>(
          chart(std::cos(angle) * dx + std::sin(angle) * dy, -std::sin(angle) * dx + std::cos(angle) * dy));
    }
  return image;
}

// A blurred star on a blurred disc, as a lens images it.
double star(double x, double y) {
  const double radius = std::hypot(x, y), waves = 1 - std::exp(-radius * radius / 60);
  return 0.1 / (1 + std::exp((radius - 38) / 1.5)) * (1 + waves * std::cos(12 * std::atan2(y, x)));
}

// A pattern that fills the whole image.
double waves(double x, double y) {
  return 0.5 + 0.1 * std::cos(0.31 * x + 0.11 * y) + 0.1 * std::cos(0.09 * x - 0.23 * y + 1) + 0.1 * std::cos(0.05 * x);
}

void expect_found(const Registration& found, const Registration& painted, double within_px, double within_deg) {
  EXPECT_NEAR(found.shift_x_px, painted.shift_x_px, within_px);
  EXPECT_NEAR(found.shift_y_px, painted.shift_y_px, within_px);
  EXPECT_NEAR(found.rotation_deg, painted.rotation_deg, within_deg);
}

const Registration kPainted[] = {{0, 0, 0}, {0.4, -0.3, 0.2}, {-3.7, 2.2, -1.5}, {12.3, 8.9, 4}, {-15, 9.6, -6}};

TEST(Registration, FindsShiftAndRotationOfStar) {
  for (const Registration& painted : kPainted)
    expect_found(registration(shown(star, painted), shown(star, {})), painted, 0.01, 0.02);
}

TEST(Registration, FindsShiftAndRotationOfFullFrameChart) {
  for (const Registration& painted : {kPainted[0], kPainted[1], kPainted[2]})  // less than half a period of the waves
    expect_found(registration(shown(waves, painted), shown(waves, {})), painted, 0.01, 0.02);
}

TEST(Registration, FindsStarFarFromTheCentre) {
  const Registration painted{61.5, -33.2, 3};
  expect_found(registration(shown(star, painted, 220, 201), shown(star, {}, 220, 201)), painted, 0.01, 0.02);
}

TEST(Registration, AcceptsDecentredReference) {
  // Without rotation the shifts of image and reference subtract.
  const Registration found = registration(shown(star, {5, -2, 0}), shown(star, {-4.5, 1.25, 0}));
  expect_found(found, {9.5, -3.25, 0}, 0.01, 0.02);
}

TEST(Registration, IgnoresLevelAndContrast) {
  Image image = shown(star, kPainted[2]);
  for (float& value : image.values) value = 0.3F + 8 * value;
  expect_found(registration(image, shown(star, {})), kPainted[2], 0.01, 0.02);
}

TEST(Registration, ToleratesNoise) {
  // Noise of a capture of the paper's scene: about two photons per lit pixel.
  Random random(7);
  Image image = shown(star, kPainted[2]);
  for (float& value : image.values) {
    const double light = static_cast<double>(value);
    value = static_cast<float>(light + std::sqrt(0.06 * light) * random.normal());
  }
  expect_found(registration(image, shown(star, {})), kPainted[2], 0.15, 0.3);
}

TEST(Registration, IsNanWhereUndetermined) {
  const Chart spot = [](double x, double y) { return std::exp(-(x * x + y * y) / 50); };
  const Registration of_spot = registration(shown(spot, {3.2, -1.4, 0}), shown(spot, {}));
  EXPECT_NEAR(of_spot.shift_x_px, 3.2, 0.01);
  EXPECT_NEAR(of_spot.shift_y_px, -1.4, 0.01);
  EXPECT_TRUE(std::isnan(of_spot.rotation_deg)) << of_spot.rotation_deg;
  const Chart edge = [](double x, double) { return std::tanh(x / 3); };
  const Registration of_edge = registration(shown(edge, {2.5, 0, 3}), shown(edge, {}));
  EXPECT_NEAR(of_edge.rotation_deg, 3, 0.02);
  EXPECT_TRUE(std::isnan(of_edge.shift_y_px)) << of_edge.shift_y_px;
}

TEST(Registration, IsNanForDifferentContent) {
  const auto is_nan = [](const Registration& found) {
    return std::isnan(found.shift_x_px) && std::isnan(found.shift_y_px) && std::isnan(found.rotation_deg);
  };
  const Image reference = shown(star, {});
  for (const float level : {0.0F, 0.2F, 0.4F, 3e5F})
    EXPECT_TRUE(is_nan(registration(Image(160, 120, level), reference))) << "uniform image of " << level;
  EXPECT_TRUE(is_nan(registration(reference, Image(160, 120, 0.4F)))) << "uniform reference";
  EXPECT_TRUE(is_nan(registration(shown(star, {}, 100, 120), reference))) << "another size";
  EXPECT_TRUE(is_nan(registration(Image(4, 4, 1), Image(4, 4, 1)))) << "too small";
  Random random(2);
  Image noise(160, 120);
  for (float& value : noise.values) value = static_cast<float>(random.normal());
  EXPECT_TRUE(is_nan(registration(noise, reference)));
  Image negative = reference;
  for (float& value : negative.values) value = -value;
  EXPECT_TRUE(is_nan(registration(negative, reference))) << "inverted contrast";
  Image broken = reference;
  broken.at(30, 30) = std::nanf("");
  EXPECT_TRUE(is_nan(registration(broken, reference)));
}

}  // namespace
}  // namespace relign::images::registration_tests
