// Derivatives of images against central differences of noise-free images with the same rays.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

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

TEST(Derivatives, Look) {
  for (const std::string& name : shipped_scenes()) {
    SceneChoices choices;
    if (const char* target = std::getenv("TARGET")) choices.target = target;
    if (const char* px = std::getenv("PX")) choices.pixels = std::atoi(px);
    if (const char* only = std::getenv("SCENE"); only && name != only) continue;
    const SceneFile scene = read_scene_file(scene_folder() + name + "/scene.json", choices);
    Parallel parallel(2);
    Camera camera(scene, {}, parallel);
    MountedLens lens(scene);
    std::vector<double> pose(scene.axes(), 0.5);
    pose[0] = 0.47;
    pose[2] = 0.56;
    pose[3] = 0.55;
    const int groups = std::getenv("NG") ? std::atoi(std::getenv("NG")) : 4;
    const Images f1 = differentiated(camera, scene, lens, pose, 1, groups);
    const Images f2 = differentiated(camera, scene, lens, pose, 2, groups);
    const Images d1 = differences(camera, scene, lens, pose, 3, 4 * groups);
    const Images d2 = differences(camera, scene, lens, pose, 4, 4 * groups);
    for (std::size_t axis = 0; axis < pose.size(); ++axis) {
      const double size = product(d1[axis], d2[axis]);
      const double error = product(minus(f1[axis], d1[axis]), minus(f2[axis], d2[axis])) / size;
      if (const char* dump = std::getenv("DUMP")) {
        FILE* file = std::fopen((std::string(dump) + name + std::to_string(axis) + ".txt").c_str(), "w");
        for (std::size_t i = 0; i < d1[axis].size(); ++i) std::fprintf(file, "%g %g\n", 0.5 * (f1[axis][i] + f2[axis][i]), 0.5 * (d1[axis][i] + d2[axis][i]));
        std::fclose(file);
      }
      const double noise_f = product(minus(f1[axis], f2[axis]), minus(f1[axis], f2[axis])) / size / 2;
      const double noise_d = product(minus(d1[axis], d2[axis]), minus(d1[axis], d2[axis])) / size / 2;
      std::printf("%-20s axis %zu: norm %.4g, bias %.3g %%, +- %.3g %%, noise of derivative %.3g %%, of difference %.3g %%\n",
                  name.c_str(), axis, std::sqrt(size), 100 * std::copysign(std::sqrt(std::abs(error)), error),
                  100 * std::sqrt((noise_f + noise_d) / std::sqrt(static_cast<double>(scene.sensor.pixels()))),
                  100 * std::sqrt(noise_f), 100 * std::sqrt(noise_d));
    }
  }
}

}  // namespace
}  // namespace relign::imaging::derivatives
