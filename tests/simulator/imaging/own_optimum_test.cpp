#include "imaging/own_optimum.h"

#include <gtest/gtest.h>

#include <cmath>

#include "scene_under_test.h"

namespace relign::imaging {
namespace {

struct Bench {
  explicit Bench(unsigned threads) : parallel(threads) {}
  Parallel parallel;
  CaptureSettings settings;
  Reference reference = make_reference(relign_od_scene(), settings, parallel, {}, {});
  Camera camera{relign_od_scene(), settings, parallel};
  OptimumFinder finder{relign_od_scene(), settings, camera, parallel, reference};

  // Mean of several MSE estimates, with a fourth of the error.
  double mse(MountedLens& lens, const std::vector<double>& pose) {
    constexpr int kSeeds = 20;
    double sum = 0;
    for (std::uint64_t seed = 100; seed < 100 + kSeeds; ++seed)
      sum += camera.noise_free_mse(lens, pose, seed, reference).mse / kSeeds;
    return sum;
  }
};

TEST(OwnOptimum, OfThePerfectLensIsTheNominalPose) {
  Bench bench(2);
  MountedLens lens(relign_od_scene());
  const std::vector<double> by_rays = bench.finder.by_rays(lens);
  const OwnOptimum found = bench.finder.find(lens, 3);
  for (std::size_t axis = 0; axis < 5; ++axis) {
    EXPECT_NEAR(by_rays[axis], 0.5, 1e-6) << axis;
    EXPECT_NEAR(found.true_pose[axis], 0.5, 0.001) << axis;
  }
  EXPECT_NEAR(found.error.mse, 0, 5 * found.error.standard_error);
}

// RMSE at the nominal pose 0.04, at the own optimum 0.001 to 0.003 (published: coarse fits of ten assemblies).
TEST(OwnOptimum, IsAMinimumOfTheNoiseFreeError) {
  Bench bench(2);
  Random random(5);
  for (int assembly = 0; assembly < 2; ++assembly) {
    MountedLens lens(relign_od_scene(), random_assembly(random));
    const OwnOptimum found = bench.finder.find(lens, 3);
    const double there = bench.mse(lens, found.true_pose);
    EXPECT_NEAR(found.error.mse, there, 5 * found.error.standard_error);
    EXPECT_LT(std::sqrt(there), 0.004);
    EXPECT_GT(std::sqrt(bench.mse(lens, nominal_pose())), 0.02);
    // Poses more than 4 um across, 20 um along the axis or 0.03 degrees away must be worse.
    const double steps[5] = {0.002, 0.002, 0.01, 0.002, 0.002};
    for (std::size_t axis = 0; axis < 5; ++axis)
      for (const double sign : {-1.0, 1.0}) {
        std::vector<double> other = found.true_pose;
        other[axis] += sign * steps[axis];
        EXPECT_GT(bench.mse(lens, other), there - 1e-7) << "axis " << axis << ", " << sign;
      }
  }
}

TEST(OwnOptimum, DependsOnlyOnLensAndSeed) {
  Random random(6);
  const optics::Assembly assembly = random_assembly(random);
  std::vector<double> first;
  double mse = 0;
  for (const unsigned threads : {1U, 2U, 3U}) {
    Bench bench(threads);
    MountedLens lens(relign_od_scene(), assembly);
    if (threads == 2) bench.finder.by_rays(lens);  // earlier searches must not matter
    const OwnOptimum found = bench.finder.find(lens, 4);
    if (first.empty()) {
      first = found.true_pose;
      mse = found.error.mse;
    }
    EXPECT_EQ(found.true_pose, first) << threads;
    EXPECT_EQ(found.error.mse, mse) << threads;
  }
}

}  // namespace
}  // namespace relign::imaging
