// Derivatives of images against central differences of noise-free images with the same rays.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "error_text.h"
#include "imaging/pose_motion.h"
#include "scene_under_test.h"

namespace relign::imaging::derivatives {
namespace {

using Images = std::vector<std::vector<double>>;  // by axis

// The derivatives by each axis of the pose, from `groups` renders of 256 rays per pixel.
Images differentiated(Camera& camera, const SceneFile& scene, MountedLens& lens, const std::vector<double>& pose,
                      std::uint64_t seed, int groups) {
  const std::size_t pixels = scene.sensor.pixels();
  const std::vector<Twist> twists = twists_of_axes(scene, pose);
  Images images(twists.size(), std::vector<double>(pixels));
  std::vector<float> image(pixels), wrenches(pixels * 6);
  for (int group = 0; group < groups; ++group) {
    camera.render_derivatives(lens, pose, seed, static_cast<std::uint32_t>(group), 256, {}, image.data(),
                              wrenches.data());
    for (std::size_t axis = 0; axis < twists.size(); ++axis)
      for (std::size_t i = 0; i < pixels; ++i)
        for (std::size_t k = 0; k < 6; ++k)
          images[axis][i] += twists[axis][k] * static_cast<double>(wrenches[6 * i + k]) / groups;
  }
  return images;
}

// Differences of images over four poses an axis, with an error of fourth order in the step.
Images differences(Camera& camera, const SceneFile& scene, MountedLens& lens, const std::vector<double>& pose,
                   std::uint64_t seed, int groups) {
  constexpr double kStep = 2.5e-3;
  const std::pair<double, double> poses[] = {{1, 8}, {-1, -8}, {2, -1}, {-2, 1}};  // steps, weight
  Images images;
  std::vector<float> image(scene.sensor.pixels());
  for (std::size_t axis = 0; axis < pose.size(); ++axis) {
    std::vector<double> difference(image.size());
    for (const auto& [steps, weight] : poses) {
      std::vector<double> moved = pose;
      moved[axis] += steps * kStep;
      NoiseFreeRequest request;
      request.seed = seed;
      request.samples = 256L * groups;
      camera.render_noise_free(lens, moved, request, image.data());
      for (std::size_t i = 0; i < image.size(); ++i)
        difference[i] += weight * static_cast<double>(image[i]) / (12 * kStep);
    }
    images.push_back(difference);
  }
  return images;
}

double product(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

std::vector<double> minus(std::vector<double> a, const std::vector<double>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] -= b[i];
  return a;
}

// What derivatives and differences (two independent estimates of each) disagree by, without their noise, as a share of
// `size`, the square of a norm; and the standard error of its square.
struct Disagreement {
  double square = 0, error = 0;
};
Disagreement disagreement(const std::vector<double>& f1, const std::vector<double>& f2, const std::vector<double>& d1,
                          const std::vector<double>& d2, double size) {
  const std::vector<double> one = minus(f1, d1), other = minus(f2, d2);
  double spread = 0;
  for (std::size_t i = 0; i < one.size(); ++i) spread += one[i] * one[i] * other[i] * other[i];
  return {product(one, other) / size, std::sqrt(spread) / size};
}

struct Case {
  std::string scene;
  double limit;  // of the relative disagreement
  double noise;  // most, of the comparison
};

SceneFile small(const std::string& name) {
  SceneChoices choices;
  choices.pixels = name == "phone" ? 36 : 60;  // steep aspheres take long
  const std::string file = name == "phone"
                               ? std::string(RELIGN_SOURCE_DIR) + "/tests/simulator/imaging/phone/scene.json"
                               : scene_folder() + name + "/scene.json";
  return read_scene_file(file, choices);
}

std::vector<double> off_nominal(const SceneFile& scene) {
  std::vector<double> pose(scene.axes(), 0.5);
  pose[0] = 0.47;
  pose[2] = 0.56;
  pose[3] = 0.55;
  return pose;
}

class OfScene : public ::testing::TestWithParam<Case> {};

TEST_P(OfScene, EqualDifferencesOfImages) {
  const SceneFile scene = small(GetParam().scene);
  Parallel parallel(2);
  Camera camera(scene, {}, parallel);
  MountedLens lens(scene);
  const std::vector<double> pose = off_nominal(scene);
  constexpr int kGroups = 4;
  const Images f1 = differentiated(camera, scene, lens, pose, 1, kGroups);
  const Images f2 = differentiated(camera, scene, lens, pose, 2, kGroups);
  const Images d1 = differences(camera, scene, lens, pose, 3, 4 * kGroups);
  const Images d2 = differences(camera, scene, lens, pose, 4, 4 * kGroups);
  double largest = 0;  // an axis that hardly changes the image has errors like those of the others
  for (std::size_t axis = 0; axis < pose.size(); ++axis) largest = std::max(largest, product(d1[axis], d2[axis]));
  for (std::size_t axis = 0; axis < pose.size(); ++axis) {
    const Disagreement found = disagreement(f1[axis], f2[axis], d1[axis], d2[axis], largest);
    EXPECT_LT(found.square, GetParam().limit * GetParam().limit + 3 * found.error) << "axis " << axis;
    EXPECT_LT(found.error, GetParam().noise * GetParam().noise) << "axis " << axis << ": too noisy to tell";
    if (std::getenv("LOOK"))
      std::printf("%-20s axis %zu: norm %.4g, disagreement %.3g %%, error %.3g %%\n", GetParam().scene.c_str(), axis,
                  std::sqrt(product(d1[axis], d2[axis])),
                  100 * std::copysign(std::sqrt(std::abs(found.square)), found.square), 100 * std::sqrt(found.error));
  }
}
INSTANTIATE_TEST_SUITE_P(Derivatives, OfScene,
                         ::testing::Values(Case{"relign_od", 0.01, 0.02}, Case{"relign4_telecentric", 0.01, 0.02},
                                           Case{"phone", 0.02, 0.05}),
                         [](const auto& of) { return of.param.scene; });

// Elements of a displaced lens, against differences of lenses displaced a little more.
TEST(Derivatives, OfElementsEqualDifferencesOfLenses) {
  const SceneFile scene = small("relign_od");
  Parallel parallel(2);
  Camera camera(scene, {}, parallel);
  const std::vector<double> pose = off_nominal(scene);
  const std::size_t pixels = scene.sensor.pixels();
  const auto assembly = [&](std::size_t number, double by) {
    optics::ElementOffset l3;
    l3.shift_mm[0] = 0.01 + (number == 0 ? by : 0);
    l3.shift_mm[2] = number == 2 ? by : 0;
    l3.tilt_deg[0] = number == 3 ? by * 180 / 3.14159265358979 : 0;
    return optics::Assembly(scene.lens, {{"L3", l3}});
  };
  MovingParts parts{false, {2}};
  ASSERT_EQ(scene.lens.elements[2].name, "L3");
  constexpr int kGroups = 8;
  const auto derivatives = [&](std::uint64_t seed) {
    MountedLens lens(scene, assembly(9, 0));
    std::vector<double> sums(pixels * 6);
    std::vector<float> image(pixels), wrenches(pixels * 6);
    for (std::uint32_t group = 0; group < kGroups; ++group) {
      camera.render_derivatives(lens, pose, seed, group, 256, parts, image.data(), wrenches.data());
      for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += static_cast<double>(wrenches[i]) / kGroups;
    }
    return sums;
  };
  const std::vector<double> all1 = derivatives(1), all2 = derivatives(2);
  // A tilt turns about the pivot, not about the lens's origin.
  const double pivot = scene.lens.pivot_z_mm;
  const auto along = [&](const std::vector<double>& all, std::size_t number) {
    std::vector<double> one(pixels);
    for (std::size_t i = 0; i < pixels; ++i)
      one[i] = number < 3 ? all[6 * i + number] : all[6 * i + 3] + pivot * all[6 * i + 1];
    return one;
  };
  for (const std::size_t number : {0U, 2U, 3U}) {
    const double step = number == 3 ? 2e-3 : 0.01;
    const auto difference = [&](std::uint64_t seed) {
      std::vector<double> sum(pixels);
      std::vector<float> image(pixels);
      for (const auto& [steps, weight] : {std::pair{1.0, 8.0}, {-1.0, -8.0}, {2.0, -1.0}, {-2.0, 1.0}}) {
        MountedLens lens(scene, assembly(number, steps * step));
        NoiseFreeRequest request;
        request.seed = seed;
        request.samples = 256L * 4 * kGroups;
        camera.render_noise_free(lens, pose, request, image.data());
        for (std::size_t i = 0; i < pixels; ++i) sum[i] += weight * static_cast<double>(image[i]) / (12 * step);
      }
      return sum;
    };
    const std::vector<double> d1 = difference(3), d2 = difference(4);
    const Disagreement found = disagreement(along(all1, number), along(all2, number), d1, d2, product(d1, d2));
    EXPECT_LT(found.square, 0.02 * 0.02 + 3 * found.error) << "number " << number;
    EXPECT_LT(found.error, 0.05 * 0.05) << "number " << number;
  }
}

TEST(Derivatives, LeaveTheBitsOfImages) {
  const SceneFile scene = small("relign_od");
  Parallel parallel(2);
  MountedLens lens(scene);
  const std::vector<double> pose = off_nominal(scene);
  std::vector<float> plain(scene.sensor.pixels()), beside(plain.size()), wrenches(6 * plain.size());
  for (const Sampler sampler : {Sampler::paper, Sampler::hemisphere, Sampler::pupil, Sampler::lattice}) {
    CaptureSettings settings;
    settings.sampler = sampler;
    Camera camera(scene, settings, parallel);
    camera.capture(lens, pose, 5, plain.data());
    camera.render_derivatives(lens, pose, 5, 0, 0, {}, beside.data(), wrenches.data());
    EXPECT_EQ(plain, beside) << static_cast<int>(sampler);
  }
  Camera camera(scene, {}, parallel);
  camera.render_noise_free(lens, pose, 5, 64, plain.data());
  camera.render_derivatives(lens, pose, 5, 0, 64, {}, beside.data(), wrenches.data());
  EXPECT_EQ(plain, beside);
}

// The roulette of the paper's noise is replaced by its mean: the derivatives of many captures have the mean of the
// noise-free ones.
TEST(Derivatives, OfCapturesHaveTheirMean) {
  const SceneFile scene = small("relign_od");
  Parallel parallel(2);
  Camera camera(scene, {}, parallel);
  MountedLens lens(scene);
  const std::vector<double> pose = off_nominal(scene);
  const std::size_t pixels = scene.sensor.pixels();
  std::vector<float> image(pixels), wrenches(6 * pixels);
  std::vector<double> clean(6 * pixels), sum(6 * pixels);
  constexpr int kCaptures = 300;
  for (std::uint32_t k = 0; k < kCaptures; ++k) {
    camera.render_derivatives(lens, pose, k, 0, 0, {}, image.data(), wrenches.data());
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += static_cast<double>(wrenches[i]) / kCaptures;
  }
  camera.render_derivatives(lens, pose, 1, 0, 1024, {}, image.data(), wrenches.data());
  for (std::size_t i = 0; i < sum.size(); ++i) clean[i] = static_cast<double>(wrenches[i]);
  // The scale, for which the noise averages out over the pixels.
  EXPECT_NEAR(product(sum, clean) / product(clean, clean), 1, 0.01);
}

TEST(Derivatives, OfTheMseEqualItsDifferences) {
  const SceneFile scene = small("relign_od");
  Parallel parallel(2);
  Camera camera(scene, {}, parallel);
  MountedLens lens(scene);
  const Reference reference = make_reference(scene, {}, parallel, {}, {});
  const std::vector<double> pose = off_nominal(scene);
  const std::vector<Twist> twists = twists_of_axes(scene, pose);
  constexpr int kSeeds = 40;
  std::vector<double> found(pose.size()), spread(pose.size()), difference(pose.size()), difference_spread(pose.size());
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    MseSlopes slopes;
    const MseEstimate mse = camera.noise_free_mse(lens, pose, seed, reference, slopes);
    EXPECT_EQ(mse.mse, camera.noise_free_mse(lens, pose, seed, reference).mse);
    for (std::size_t axis = 0; axis < pose.size(); ++axis) {
      double slope = 0, bend = 0;
      for (std::size_t i = 0; i < 6; ++i) {
        slope += twists[axis][i] * slopes.gradient[i];
        for (std::size_t j = 0; j < 6; ++j) bend += twists[axis][i] * twists[axis][j] * slopes.gauss_newton[6 * i + j];
      }
      EXPECT_GT(bend, 0);
      constexpr double kStep = 2e-3;
      std::vector<double> low = pose, high = pose;
      low[axis] -= kStep;
      high[axis] += kStep;
      const double by_steps = (camera.noise_free_mse(lens, high, seed, reference).mse -
                               camera.noise_free_mse(lens, low, seed, reference).mse) /
                              (2 * kStep);
      found[axis] += slope / kSeeds;
      spread[axis] += slope * slope / kSeeds;
      difference[axis] += by_steps / kSeeds;
      difference_spread[axis] += by_steps * by_steps / kSeeds;
    }
  }
  for (std::size_t axis = 0; axis < pose.size(); ++axis) {
    const double variance =
        (spread[axis] - found[axis] * found[axis] + difference_spread[axis] - difference[axis] * difference[axis]) /
        (kSeeds - 1);
    EXPECT_NEAR(found[axis], difference[axis], 0.01 * std::abs(difference[axis]) + 4 * std::sqrt(variance))
        << "axis " << axis;
  }
}

TEST(Derivatives, AreRefusedWhereTheyDoNotExist) {
  const SceneFile scene = small("relign_od");
  Parallel parallel(1);
  CaptureSettings settings;
  settings.transport = Transport::ghost;
  Camera camera(scene, settings, parallel);
  MountedLens lens(scene);
  std::vector<float> image(scene.sensor.pixels()), wrenches(6 * image.size());
  EXPECT_EQ(
      test::error_text(
          ErrorKind::bad_input,
          [&] { camera.render_derivatives(lens, nominal_pose(), 1, 0, 0, {}, image.data(), wrenches.data()); }),
      "scene 'relign_od': images with transport 'ghost' have no derivatives; they exist for a lens of faces, with "
      "transport 'refract' or 'fresnel'");
}

TEST(PoseMotion, TwistsMoveTheLensAsThePoseDoes) {
  const SceneFile& scene = relign_od_scene();
  const std::vector<double> pose = {0.4, 0.55, 0.5, 0.7, 0.35};
  const std::vector<Twist> twists = twists_of_axes(scene, pose);
  const optics::Vec3 point{1.3, -0.4, 7};
  for (std::size_t axis = 0; axis < pose.size(); ++axis) {
    constexpr double kStep = 1e-5;
    std::vector<double> moved = pose;
    moved[axis] += kStep;
    const optics::Vec3 there = scene.lens_to_world(moved).point(point), here = scene.lens_to_world(pose).point(point);
    const Twist& t = twists[axis];
    const optics::Vec3 by{t[0] + t[4] * point.z - t[5] * point.y, t[1] + t[5] * point.x - t[3] * point.z,
                          t[2] + t[3] * point.y - t[4] * point.x};
    const optics::Vec3 expected = scene.lens_to_world(pose).direction(by);
    EXPECT_NEAR((there.x - here.x) / kStep, expected.x, 1e-4);
    EXPECT_NEAR((there.y - here.y) / kStep, expected.y, 1e-4);
    EXPECT_NEAR((there.z - here.z) / kStep, expected.z, 1e-4);
  }
}

}  // namespace
}  // namespace relign::imaging::derivatives
