#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/json_source.h"
#include "error_text.h"
#include "plugin_host/objects.h"

namespace relign {
namespace {

using plugin_host::MountedAssembly;
using plugin_host::Scene;
using Pose = std::vector<double>;

constexpr double kPi = 3.14159265358979323846;
constexpr std::size_t kSide = 50;
constexpr double kArea = 0.0016;  // of a pixel, square millimetres

struct Bench {
  explicit Bench(const Json& parameters = Json::object()) : scene(choice(parameters), {}), spot(scene.mount("{}")) {}

  static plugin_host::Choice choice(const Json& parameters) {
    plugin_host::Catalog catalog;
    catalog.add(std::string(RELIGN_PLUGIN_DIR) + "/gaussian_spot");
    return catalog.resolve_or_throw(plugin_host::Kind::scene, "gaussian_spot", parameters);
  }
  std::vector<float> clean(const Pose& pose) {
    std::vector<float> pixels(kSide * kSide);
    EXPECT_TRUE(spot.render_noise_free(pose, pixels.data()));
    return pixels;
  }
  std::vector<float> captured(const Pose& pose, std::uint64_t seed) {
    std::vector<float> pixels(kSide * kSide);
    spot.capture(pose, seed, pixels.data());
    return pixels;
  }

  Scene scene;
  MountedAssembly spot;
};

// A bivariate normal density by its centre and covariance matrix.
struct Gaussian {
  explicit Gaussian(const Pose& pose) : x(-1 + 2 * pose[0]), y(-1 + 2 * pose[1]) {
    const double v1 = 0.05 + pose[2] * pose[2] / 5, v2 = 0.05 + pose[3] * pose[3] / 5;
    const double c = std::cos(kPi / 2 * pose[4]), s = std::sin(kPi / 2 * pose[4]);
    xx = c * c * v1 + s * s * v2;
    yy = s * s * v1 + c * c * v2;
    xy = c * s * (v1 - v2);
  }
  double at(double px, double py) const {
    const double determinant = xx * yy - xy * xy, dx = px - x, dy = py - y;
    return std::exp(-0.5 * (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / determinant) /
           (2 * kPi * std::sqrt(determinant));
  }
  // Integral of the product of two over the infinite plane: a density with the sum of both covariances.
  static double overlap(const Gaussian& a, const Gaussian& b) {
    Gaussian sum = a;
    sum.xx += b.xx;
    sum.yy += b.yy;
    sum.xy += b.xy;
    return sum.at(b.x, b.y);
  }
  double x, y, xx = 0, yy = 0, xy = 0;
};

const Pose kNominal = {0.5, 0.5, 0.5, 0.5, 0.5};
const Pose kTilted = {0.6, 0.45, 0.7, 0.1, 0.3};

TEST(GaussianSpot, PixelsMatchDensityAtTheirCentres) {
  Bench bench;
  for (const Pose& pose : {kNominal, kTilted, Pose{0, 1, 1, 0, 1}}) {
    const Gaussian gaussian(pose);
    const std::vector<float> pixels = bench.clean(pose);
    for (std::size_t row = 0; row < kSide; ++row)
      for (std::size_t column = 0; column < kSide; ++column) {
        const double x = -0.98 + 0.04 * static_cast<double>(column), y = 0.98 - 0.04 * static_cast<double>(row);
        ASSERT_NEAR(pixels[row * kSide + column], gaussian.at(x, y), 1e-6) << row << " " << column;
      }
  }
  const relign_image reference = bench.scene.reference();
  ASSERT_EQ(reference.width * reference.height, kSide * kSide);
  EXPECT_EQ(std::vector<float>(reference.pixels, reference.pixels + kSide * kSide), bench.clean(kNominal));
}

TEST(GaussianSpot, NoiseFreeMseMatchesIntegral) {
  Bench bench;
  const Gaussian nominal(kNominal);
  for (const Pose& pose :
       {Pose{0.52, 0.5, 0.5, 0.5, 0.5}, Pose{0.5, 0.5, 0.3, 0.5, 0.9}, Pose{0.55, 0.45, 0.4, 0.2, 0.3}}) {
    const Gaussian moved(pose);
    const double integral =
        Gaussian::overlap(moved, moved) + Gaussian::overlap(nominal, nominal) - 2 * Gaussian::overlap(moved, nominal);
    const auto truth = bench.spot.noise_free_mse(pose, 1);
    // The square has 4 mm^2; less than 3 in 1,000 of these integrals is outside.
    EXPECT_NEAR(truth.mse / (integral / 4), 1, 3e-3);
    EXPECT_EQ(truth.standard_error, 0);
  }
  EXPECT_EQ(bench.spot.noise_free_mse(kNominal, 1).mse, 0);
  // A round spot does not depend on the angle, up to rounding.
  EXPECT_LT(bench.spot.noise_free_mse({0.5, 0.5, 0.5, 0.5, 0.1}, 1).mse, 1e-12);
}

TEST(GaussianSpot, NoiseHasPhotonVariance) {
  const double photons = 2e5;
  Bench bench(Json{{"photons", photons}});
  const std::vector<float> clean = bench.clean(kTilted);
  double n = 0, sum = 0, squares = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const std::vector<float> noisy = bench.captured(kTilted, seed);
    for (std::size_t i = 0; i < clean.size(); ++i) {
      if (clean[i] < 1e-3F) continue;  // rounding to float would dominate
      const double deviate = (double{noisy[i]} - clean[i]) / std::sqrt(clean[i] / (photons * kArea));
      ++n;
      sum += deviate;
      squares += deviate * deviate;
    }
  }
  EXPECT_GT(n, 10000);
  EXPECT_NEAR(sum / n, 0, 5 / std::sqrt(n));
  EXPECT_NEAR(squares / n, 1, 5 * std::sqrt(2 / n));
  EXPECT_EQ(bench.captured(kTilted, 3), bench.captured(kTilted, 3));
  EXPECT_NE(bench.captured(kTilted, 3), bench.captured(kTilted, 4));
  Bench dark_room(Json{{"photons", 0}});
  EXPECT_EQ(dark_room.captured(kTilted, 3), dark_room.clean(kTilted));
}

// NumPy gives the same clean pixels and, up to the order of the sum (5e-15), the same MSE.
TEST(GaussianSpot, MatchesFrozenBits) {
  Bench bench;
  const std::vector<float> clean = bench.clean(kTilted), noisy = bench.captured(kTilted, 7);
  EXPECT_EQ(clean[20 * kSide + 30], 0x1.f05c4ap-1F);
  EXPECT_EQ(clean[49 * kSide + 1], 0x1.149148p-10F);
  EXPECT_EQ(noisy[20 * kSide + 30], 0x1.e68458p-1F);
  EXPECT_EQ(noisy[27 * kSide + 22], 0x1.32bf24p+0F);
  EXPECT_EQ(bench.spot.noise_free_mse(kTilted, 1).mse, 0x1.1e8c14a0907cdp-4);
}

TEST(GaussianSpot, HasNoElements) {
  Bench bench;
  EXPECT_EQ(Json::parse(bench.scene.describe()).at("elements"), Json::array());
  EXPECT_THAT(test::error_text(ErrorKind::plugin_failed, [&] { bench.scene.mount(R"({"L1": {}})"); }),
              testing::HasSubstr("no elements"));
}

}  // namespace
}  // namespace relign
