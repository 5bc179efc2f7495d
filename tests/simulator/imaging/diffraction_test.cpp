// Diffraction in images: the kernels against the closed form, the edge of a rendered image against the product of
// geometric and diffraction-limited MTF, and the noise-free MSE of blurred scenes.
#include "imaging/diffraction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "hyperboloids.h"
#include "images/measures.h"
#include "imaging/camera.h"
#include "imaging/reference.h"
#include "optics/pi.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

using optics::kPi;

double circular_pupil_mtf(double s) { return s < 1 ? 2 / kPi * (std::acos(s) - s * std::sqrt(1 - s * s)) : 0; }

// NA 0.02: limit 72.7 lp/mm. Pixels of `pitch_mm` under a target that its lens images at life size.
SceneFile edge_scene(double pitch_mm, int pixels, const std::string& target) {
  SceneFile scene = hyperbolic_scene();
  scene.sensor.pitch_mm = pitch_mm;
  scene.sensor.width = scene.sensor.height = pixels;
  scene.sensor.left_mm = -pitch_mm * pixels / 2;
  scene.sensor.top_mm = pitch_mm * pixels / 2;
  scene.emitter.side_mm = 2 * pitch_mm * pixels;
  // A straight edge, 5 degrees off the columns, drawn finely.
  constexpr int kTexels = 2048;
  images::Image image;
  image.width = image.height = kTexels;
  image.values.assign(static_cast<std::size_t>(kTexels) * kTexels, 1.0F);
  if (target == "edge")
    for (int y = 0; y < kTexels; ++y)
      for (int x = 0; x < kTexels; ++x) {
        const double off = (x - kTexels / 2) + std::tan(5 * kPi / 180) * (y - kTexels / 2) + 0.5;
        image.values[static_cast<std::size_t>(y) * kTexels + static_cast<std::size_t>(x)] =
            static_cast<float>(std::clamp(off, 0.0, 1.0));
      }
  scene.emitter.show(std::move(image));
  return scene;
}

const double kSine = kStopRadius_mm / std::hypot(kStopRadius_mm, kFocus_mm);
constexpr double kWavelength_mm = 550e-6;

TEST(Diffraction, KernelsHaveTheTransferOfACircularPupil) {
  double largest = 0;
  for (const double pitch_mm : {0.013, 0.02, 0.04}) {  // 1.1, 0.7 and 0.3 pixels are wavelength x f-number
    const SceneFile scene = edge_scene(pitch_mm, 40, "edge");
    const Diffraction diffraction(scene);
    std::printf("pitch %.3f mm: radius %d pixels, overlap %.4f\n", pitch_mm, diffraction.radius(),
                diffraction.overlap());
    EXPECT_NEAR(diffraction.transfer(20, 20, 0, 0), 1, 1e-12);
    for (double cycles = 0.02; cycles < 0.5; cycles += 0.03)
      for (const double turns : {0.0, 0.1, 0.25}) {
        const double x = cycles * std::cos(2 * kPi * turns), y = cycles * std::sin(2 * kPi * turns);
        const double expected = circular_pupil_mtf(cycles / pitch_mm * kWavelength_mm / (2 * kSine));
        EXPECT_NEAR(diffraction.transfer(20, 20, x, y), expected, 0.012) << pitch_mm << " mm, " << cycles;
        largest = std::max(largest, std::fabs(diffraction.transfer(20, 20, x, y) - expected));
      }
  }
  std::printf("largest deviation from the closed form: %.4f\n", largest);
}

TEST(Diffraction, EdgeMtfIsTheProductOfGeometryAndDiffraction) {
  constexpr int kPixels = 96;
  double largest = 0;
  Parallel parallel(2);
  for (const double pitch_mm : {0.003, 0.006}) {
    SceneFile scene = edge_scene(pitch_mm, kPixels, "edge");
    MountedLens lens(scene);
    images::Image images[2];
    for (int with = 0; with < 2; ++with) {
      scene.diffraction = with == 1;
      images[with].width = images[with].height = kPixels;
      images[with].values.resize(scene.sensor.pixels());
      Camera camera(scene, {}, parallel);
      camera.render_noise_free(lens, nominal_pose(), 1, 256, images[with].values.data());
    }
    for (const double cycles : {0.05, 0.1, 0.15, 0.2, 0.3, 0.4}) {
      const images::Region region{16, 16, 64, 64};
      const double rays = images::edge_mtf(images[0], region, cycles);
      const double waves = images::edge_mtf(images[1], region, cycles);
      const double limit = circular_pupil_mtf(cycles / pitch_mm * kWavelength_mm / (2 * kSine));
      std::printf("pitch %.3f mm, %.2f cycles a pixel: %.4f by rays, %.4f in the image, product %.4f\n", pitch_mm,
                  cycles, rays, waves, rays * limit);
      EXPECT_NEAR(waves, rays * limit, 0.02) << pitch_mm << " mm, " << cycles;
      largest = std::max(largest, std::fabs(waves - rays * limit));
    }
  }
  std::printf("largest deviation from the product: %.4f\n", largest);
}

TEST(Diffraction, KeepsUniformImagesAndBitsForAnyThreads) {
  SceneFile scene = relign_od_scene();
  scene.diffraction = true;
  const Diffraction diffraction(scene);
  Parallel one(1), three(3);
  Diffraction::Workspace work;
  std::vector<float> even(scene.sensor.pixels(), 0.7F), blurred(even);
  diffraction.blur(even.data(), blurred.data(), three, work);
  for (const float value : blurred) EXPECT_NEAR(value, 0.7F, 1e-6F);
  std::vector<float> first(even), second(even);
  for (Parallel* parallel : {&one, &three}) {
    Camera camera(scene, {}, *parallel);
    MountedLens lens(scene);
    camera.capture(lens, {0.51, 0.5, 0.5, 0.52, 0.5}, 5, (parallel == &one ? first : second).data());
  }
  EXPECT_EQ(first, second);
}

TEST(Diffraction, MseIsUnbiasedWithCorrectError) {
  SceneFile scene = relign_od_scene_with({1, "", false, 60});
  scene.diffraction = true;
  scene.lens.wavelength_nm = 40000;  // so that much is blurred at these pixels
  Parallel parallel(2);
  const Reference reference = make_reference(scene, {}, parallel, {}, {});
  Camera camera(scene, {}, parallel);
  MountedLens lens(scene);
  for (const std::vector<double>& pose : {nominal_pose(), {0.51, 0.5, 0.5, 0.52, 0.5}}) {
    std::vector<float> exact(scene.sensor.pixels());
    camera.render_noise_free(lens, pose, 9, 1024, exact.data());
    double wanted = 0;
    for (std::size_t i = 0; i < exact.size(); ++i) {
      const double difference = static_cast<double>(exact[i]) - static_cast<double>(reference.mean[i]);
      wanted += difference * difference / static_cast<double>(exact.size());
    }
    constexpr int kSeeds = 60;
    double sum = 0, squares = 0, claimed = 0;
    for (int seed = 0; seed < kSeeds; ++seed) {
      const MseEstimate found = camera.noise_free_mse(lens, pose, static_cast<std::uint64_t>(100 + seed), reference);
      sum += found.mse / kSeeds;
      squares += found.mse * found.mse / kSeeds;
      claimed += found.standard_error * found.standard_error / kSeeds;
    }
    const double spread = std::sqrt(std::max(0.0, squares - sum * sum)), error = std::sqrt(claimed);
    std::printf("MSE %.4g, images differ by %.4g; spread %.3g, standard error %.3g\n", sum, wanted, spread, error);
    EXPECT_NEAR(sum, wanted, 4 * spread / std::sqrt(1.0 * kSeeds) + 2e-7);
    EXPECT_NEAR(error / spread, 1, 0.35);
  }
}

}  // namespace
}  // namespace relign::imaging
