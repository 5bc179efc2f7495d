// Captures of regions: the bits of whole frames, and the share of their pixels.
#include <gtest/gtest.h>

#include <cstring>

#include "base/error.h"
#include "imaging/chart_fields.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

// Pixels of the regions that differ from the whole frame's.
int different_pixels(const PixelRegions& regions, int width, const std::vector<float>& image,
                     const std::vector<float>& whole) {
  int different = 0;
  for (const PixelSpan& span : spans_of(regions, static_cast<std::size_t>(width)))
    for (std::size_t i = span.first; i < span.first + span.count; ++i)
      different += std::memcmp(&image[i], &whole[i], sizeof(float)) == 0 ? 0 : 1;
  return different;
}

void expect_bits_of_whole_frames(const SceneFile& scene, const PixelRegions& regions) {
  Parallel parallel(2);
  Camera camera(scene, {}, parallel);
  std::vector<float> whole(scene.sensor.pixels()), read(whole.size());
  MountedLens lens(scene);
  for (const double z : {0.5, 0.8, 0.05, 1.0}) {  // sharp to very blurred
    std::vector<double> pose(scene.axes(), 0.45);
    pose[2] = z;
    for (const Sampler sampler : {Sampler::pupil, Sampler::paper, Sampler::lattice, Sampler::hemisphere}) {
      camera.set_capture(sampler, 8);
      camera.capture(lens, pose, 5, whole.data());
      read.assign(read.size(), 7.0F);
      camera.capture_regions(lens, pose, 5, regions, read.data());
      EXPECT_EQ(different_pixels(regions, scene.sensor.width, read, whole), 0)
          << "z " << z << ", sampler " << static_cast<int>(sampler);
    }
  }
}

// The darkest corner, parts of tiles, an overlap, single pixels, the last column and row.
const PixelRegions kRegions = {{0, 0, 37, 5},   {470, 300, 61, 50}, {500, 310, 128, 128},
                               {700, 11, 1, 1}, {959, 0, 1, 640},   {3, 639, 950, 1}};

TEST(Regions, HaveTheBitsOfWholeFrames) { expect_bits_of_whole_frames(small_camera(), kRegions); }

TEST(Regions, HaveTheBitsOfWholeFramesOfThePaper) {
  expect_bits_of_whole_frames(relign_od_scene(), {{0, 0, 30, 30}, {90, 95, 25, 13}, {170, 20, 30, 150}});
}

TEST(Regions, HaveTheBitsOfWindowsAndAreBlackBesideThem) {
  SceneFile scene = small_camera();
  scene.sensor.windows = windows_around_fields(scene, 96);
  expect_bits_of_whole_frames(scene, {{0, 0, 960, 200}, {400, 300, 200, 100}});
}

TEST(Regions, LeaveLaterFramesUnchanged) {
  const SceneFile scene = small_camera();
  Parallel parallel(1);
  Camera camera(scene, {}, parallel), other(scene, {}, parallel);
  MountedLens lens(scene), fresh(scene);
  std::vector<float> read(scene.sensor.pixels()), after(read.size()), alone(read.size());
  std::vector<double> pose(scene.axes(), 0.52);
  camera.capture_regions(lens, pose, 1, {{10, 10, 20, 20}}, read.data());
  pose[0] = 0.47;
  camera.capture(lens, pose, 2, after.data());
  other.capture(fresh, pose, 2, alone.data());
  EXPECT_EQ(std::memcmp(after.data(), alone.data(), after.size() * sizeof(float)), 0);
}

TEST(Regions, StateTheShareOfTheirPixels) {
  SceneFile scene = small_camera();
  Parallel parallel(1);
  MountedLens lens(scene);
  const std::vector<double> pose(scene.axes(), 0.5);
  std::vector<float> read(scene.sensor.pixels());
  const auto pixels = static_cast<double>(read.size());
  Camera whole(scene, {}, parallel);
  EXPECT_DOUBLE_EQ(whole.capture_regions(lens, pose, 1, {{0, 0, 20, 20}, {10, 10, 20, 20}}, read.data()),
                   (2 * 400 - 100) / pixels);
  scene.sensor.windows = {{0, 0, 24, 24}, {48, 48, 24, 24}};
  Camera windowed(scene, {}, parallel);
  EXPECT_DOUBLE_EQ(windowed.capture_regions(lens, pose, 1, {{12, 0, 48, 60}}, read.data()),
                   (12.0 * 24 + 12 * 12) / (2 * 24 * 24));
  EXPECT_DOUBLE_EQ(windowed.capture_regions(lens, pose, 1, {{100, 100, 5, 5}}, read.data()), 0);
  EXPECT_EQ(read[100 * 960 + 100], 0);
}

TEST(Regions, NeedPixelsThatDependOnNoOthers) {
  SceneFile scene = relign_od_scene();
  scene.diffraction = true;
  Parallel parallel(1);
  EXPECT_FALSE(Camera(scene, {}, parallel).captures_regions());
  CaptureSettings ghosts;
  ghosts.transport = Transport::ghost;
  Camera camera(relign_od_scene(), ghosts, parallel);
  EXPECT_FALSE(camera.captures_regions());
  MountedLens lens(relign_od_scene());
  std::vector<float> read(relign_od_scene().sensor.pixels());
  EXPECT_THROW(camera.capture_regions(lens, nominal_pose(), 1, {{0, 0, 1, 1}}, read.data()), Error);
}

}  // namespace
}  // namespace relign::imaging
