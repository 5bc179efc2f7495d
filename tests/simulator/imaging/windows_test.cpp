// A sensor that reads out windows only: the same values there as in whole frames.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "base/error.h"
#include "imaging/chart_fields.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

bool contains(const std::vector<PixelBox>& windows, int column, int row) {
  return std::any_of(windows.begin(), windows.end(), [&](const PixelBox& window) {
    return column >= window.column && column < window.column + window.columns && row >= window.row &&
           row < window.row + window.rows;
  });
}

// Pixels that differ from the whole frame's inside the windows, or from 0 outside.
int different_pixels(const SceneFile& windowed, const std::vector<float>& image, const std::vector<float>& whole) {
  int different = 0;
  for (int row = 0; row < windowed.sensor.height; ++row)
    for (int column = 0; column < windowed.sensor.width; ++column) {
      const auto at = static_cast<std::size_t>(row * windowed.sensor.width + column);
      different += image[at] == (contains(windowed.sensor.windows, column, row) ? whole[at] : 0) ? 0 : 1;
    }
  return different;
}

TEST(Windows, HaveTheValuesOfWholeFrames) {
  const SceneFile whole = small_camera();
  SceneFile windowed = small_camera();
  windowed.sensor.windows = windows_around_fields(whole, 96);
  Parallel parallel(2);
  CaptureSettings settings;
  settings.sampler = Sampler::pupil;
  settings.samples = 8;
  Camera all(whole, settings, parallel), some(windowed, settings, parallel);
  EXPECT_EQ(all.share_read_out(), 1);
  std::vector<float> a(whole.sensor.pixels()), b(a.size(), 7.0F);
  for (const double z : {0.5, 0.8, 0.05}) {  // sharp, blurred, and very blurred
    std::vector<double> pose(whole.axes(), 0.45);
    pose[2] = z;
    MountedLens one(whole), other(windowed);
    for (const Sampler sampler : {Sampler::pupil, Sampler::paper}) {
      all.set_capture(sampler, 8);
      some.set_capture(sampler, 8);
      all.capture(one, pose, 5, a.data());
      some.capture(other, pose, 5, b.data());
      EXPECT_EQ(different_pixels(windowed, b, a), 0) << z;
    }
    all.render_noise_free(one, pose, 1, 16, a.data());
    some.render_noise_free(other, pose, 1, 16, b.data());
    EXPECT_EQ(different_pixels(windowed, b, a), 0) << z;
  }
}

TEST(Windows, CountTheirPixelsOnce) {
  SceneFile scene = small_camera();
  scene.sensor.windows = {{0, 0, 24, 24}, {12, 12, 24, 24}};  // overlapping
  Parallel parallel(1);
  const Camera camera(scene, {}, parallel);
  EXPECT_DOUBLE_EQ(camera.share_read_out() * static_cast<double>(scene.sensor.pixels()), 2 * 24 * 24 - 12 * 12);
}

TEST(Windows, HoldMarkAndRegionsOfTheirField) {
  const SceneFile scene = small_camera();
  const images::EdgeFields fields = fields_of(scene);
  const std::vector<PixelBox> windows = windows_around_fields(scene, 16);
  ASSERT_EQ(windows.size(), fields.size());
  for (std::size_t i = 0; i < fields.size(); ++i) {
    for (const auto& region : {fields[i].tangential, fields[i].sagittal}) {
      ASSERT_TRUE(region);
      EXPECT_TRUE(contains({windows[i]}, static_cast<int>(region->x), static_cast<int>(region->y)));
      EXPECT_TRUE(contains({windows[i]}, static_cast<int>(region->x + region->width) - 1,
                           static_cast<int>(region->y + region->height) - 1));
    }
    EXPECT_TRUE(contains({windows[i]}, static_cast<int>(fields[i].mark->x_px), static_cast<int>(fields[i].mark->y_px)));
  }
}

TEST(Windows, NeedFields) { EXPECT_THROW(windows_around_fields(relign_od_scene(), 128), Error); }

}  // namespace
}  // namespace relign::imaging
