// The three samplers have the same mean; paper and hemisphere have the same distribution; capture noise equals the shot
// noise measured on the paper's renderer.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "images/score.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

constexpr std::size_t kPixels = 200 * 200;

struct Pooled {
  std::vector<double> mean, variance;  // per pixel, of one capture
  int frames = 0;
};

Pooled pool(Camera& camera, MountedLens& lens, const std::vector<double>& pose, Sampler sampler, int samples,
            int frames, std::uint64_t seed) {
  Pooled pooled;
  pooled.frames = frames;
  std::vector<double> sum(kPixels), squares(kPixels);
  std::vector<float> image(kPixels);
  camera.set_capture(sampler, samples);
  for (int frame = 0; frame < frames; ++frame) {
    camera.capture(lens, pose, seed + static_cast<std::uint64_t>(frame), image.data());
    for (std::size_t i = 0; i < kPixels; ++i) {
      const double value = static_cast<double>(image[i]);
      sum[i] += value;
      squares[i] += value * value;
    }
  }
  for (std::size_t i = 0; i < kPixels; ++i) {
    pooled.mean.push_back(sum[i] / frames);
    pooled.variance.push_back(std::max(0.0, squares[i] / frames - pooled.mean[i] * pooled.mean[i]));
  }
  return pooled;
}

// Pixels beyond 3 sigma, and the whole image in sigmas.
struct Comparison {
  double share_beyond = 0;
  double whole_sigmas = 0;
};

Comparison compare(const Pooled& a, const Pooled& b) {
  // Pools 2 x 2 pixels, so that few photons per pixel are still approximately normal.
  Comparison result;
  int beyond = 0, seen = 0;
  double difference = 0, variance = 0;
  for (std::size_t y = 0; y < 200; y += 2)
    for (std::size_t x = 0; x < 200; x += 2) {
      double d = 0, v = 0;
      for (const std::size_t i : {y * 200 + x, y * 200 + x + 1, (y + 1) * 200 + x, (y + 1) * 200 + x + 1}) {
        d += a.mean[i] - b.mean[i];
        v += a.variance[i] / a.frames + b.variance[i] / b.frames;
      }
      difference += d;
      variance += v;
      ++seen;
      if (std::fabs(d) > 3 * std::sqrt(v) + 1e-12) ++beyond;
    }
  result.share_beyond = static_cast<double>(beyond) / seen;
  result.whole_sigmas = std::fabs(difference) / std::sqrt(variance);
  return result;
}

TEST(Samplers, HaveTheSameMean) {
  Parallel parallel(2);
  Random random(11);
  const optics::Assembly assembly = random_assembly(random);
  const std::vector<double> pose = {0.55, 0.46, 0.52, 0.56, 0.47};
  Camera camera(relign_od_scene(), {}, parallel);
  MountedLens lens(relign_od_scene(), assembly);
  const Pooled paper = pool(camera, lens, pose, Sampler::paper, 64, 300, 1000);
  const Pooled hemisphere = pool(camera, lens, pose, Sampler::hemisphere, 64, 80, 5000);
  const Pooled pupil = pool(camera, lens, pose, Sampler::pupil, 8, 100, 9000);
  const Pooled lattice = pool(camera, lens, pose, Sampler::lattice, 8, 100, 20000);
  for (const auto& [name, comparison] :
       {std::pair{"paper, hemisphere", compare(paper, hemisphere)}, std::pair{"paper, pupil", compare(paper, pupil)},
        std::pair{"pupil, hemisphere", compare(pupil, hemisphere)},
        std::pair{"paper, lattice", compare(paper, lattice)}}) {
    EXPECT_LE(comparison.share_beyond, 0.005) << name;
    EXPECT_LT(comparison.whole_sigmas, 3) << name;
  }
  double independent = 0, shifted = 0;
  for (std::size_t i = 0; i < kPixels; ++i) {
    independent += pupil.variance[i];
    shifted += lattice.variance[i];
  }
  EXPECT_LT(shifted, 0.6 * independent) << "of as many rays";
}

TEST(Samplers, ComparisonDetectsDifferences) {
  Parallel parallel(2);
  Camera camera(relign_od_scene(), {}, parallel);
  MountedLens lens(relign_od_scene());
  const Pooled here = pool(camera, lens, nominal_pose(), Sampler::pupil, 8, 50, 1);
  const Pooled there = pool(camera, lens, {0.504, 0.5, 0.5, 0.5, 0.5}, Sampler::pupil, 8, 50, 1);
  EXPECT_GT(compare(here, there).share_beyond, 0.005) << "eight micrometres off must show";
}

// Photon counts (values in units of pi / 64 / 0.95^4 on a black and white target) of the two samplers,
// pooled over pixels of one brightness: chi-square of two histograms, and the perturbations.
TEST(Samplers, PaperAndHemisphereHaveTheSameDistribution) {
  Parallel parallel(2);
  SceneFile white = relign_od_scene();
  white.emitter.show(images::Image(2, 2, 1.0F));
  Camera camera(white, {}, parallel);
  MountedLens lens(white);
  const double photon = 3.14159265358979 / 64 / std::pow(0.95, 4);
  std::vector<float> image(kPixels);
  std::array<std::array<double, 12>, 2> histogram{};
  std::array<double, 2> sum{}, squares{}, count{};
  int sampler_index = 0;
  for (const Sampler sampler : {Sampler::paper, Sampler::hemisphere}) {
    camera.set_capture(sampler, 64);
    for (std::uint64_t frame = 0; frame < 25; ++frame) {
      camera.capture(lens, nominal_pose(), 77 + frame, image.data());
      for (std::size_t y = 70; y < 130; ++y)  // inside the lit square, nearly flat
        for (std::size_t x = 70; x < 130; ++x) {
          const double photons = static_cast<double>(image[y * 200 + x]) / photon;
          ASSERT_NEAR(photons, std::round(photons), 1e-4);
          histogram[sampler_index][std::min<std::size_t>(11, static_cast<std::size_t>(std::lround(photons)))] += 1;
          sum[sampler_index] += photons;
          squares[sampler_index] += photons * photons;
          count[sampler_index] += 1;
        }
    }
    ++sampler_index;
  }
  double chi2 = 0;
  int degrees = -1;
  for (std::size_t k = 0; k < 12; ++k) {
    const double a = histogram[0][k], b = histogram[1][k];
    if (a + b < 20) continue;
    chi2 += (a - b) * (a - b) / (a + b);
    ++degrees;
  }
  ASSERT_GE(degrees, 6);
  EXPECT_LT(chi2, degrees + 3.7 * std::sqrt(2.0 * degrees)) << "chi-square, about p = 0.001";
  const auto variance = [&](int i) { return squares[i] / count[i] - std::pow(sum[i] / count[i], 2); };
  EXPECT_NEAR(variance(0) / variance(1), 1, 0.03);
  EXPECT_NEAR(sum[0] / count[0] * photon, 0.112, 0.002) << "lit level";
}

// The package: at the optimum RMSE = sqrt(mean(0.06027 O* - O*^2 / 64)), and a lit level of 0.112.
TEST(Samplers, CaptureNoiseMatchesThePackageAtTheOptimum) {
  Parallel parallel(2);
  const Reference reference = make_reference(relign_od_scene(), {}, parallel, {}, {});
  Camera camera(relign_od_scene(), {}, parallel);
  MountedLens lens(relign_od_scene());
  double predicted = 0;
  for (const float value : reference.mean) {
    const double o = static_cast<double>(value);
    predicted += (0.06027 * o - o * o / 64) / kPixels;
  }
  std::vector<float> image(kPixels);
  double rmse = 0, lit = 0, lit_count = 0;
  const int frames = 50;
  for (std::uint64_t frame = 0; frame < frames; ++frame) {
    camera.capture(lens, nominal_pose(), frame, image.data());
    rmse += images::rmse(image.data(), reference.mean.data(), kPixels) / frames;
    for (std::size_t i = 0; i < kPixels; ++i)
      if (reference.mean[i] > 0.105F) {
        lit += static_cast<double>(image[i]);
        lit_count += 1;
      }
  }
  EXPECT_NEAR(rmse / std::sqrt(predicted), 1, 0.01);
  EXPECT_NEAR(lit / lit_count, 0.112, 0.002);
}

}  // namespace
}  // namespace relign::imaging
