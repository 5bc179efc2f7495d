// A warped sensor: each of its tiles sees what a flat sensor at the tile's height sees.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "error_text.h"
#include "imaging/chart_fields.h"
#include "imaging/field_mtf.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

constexpr double kWarp_mm = 0.02;  // at the corners

SceneFile warped_camera() {
  SceneChoices choices;
  choices.pixels = 960;
  choices.warp_um = 1000 * kWarp_mm;
  return read_scene_file(scene_folder() + "camera_2mp/scene.json", choices);
}

TEST(WarpedSensor, CornersAreAsFarFromItsCentreAsTheFileSays) {
  const SceneFile scene = warped_camera();
  const Sensor& sensor = scene.sensor;
  EXPECT_NEAR(sensor.place(0, 0).z, sensor.z_mm + kWarp_mm, 1e-12);
  EXPECT_NEAR(sensor.place(0, sensor.height).z, sensor.z_mm + kWarp_mm, 1e-12);
  EXPECT_DOUBLE_EQ(sensor.place(0.5 * sensor.width, 0.5 * sensor.height).z, sensor.z_mm);
}

TEST(WarpedSensor, TilesHaveTheImageOfAFlatSensorAtTheirHeight) {
  SceneFile bent = warped_camera(), flat = small_camera();
  // Tiles with an edge of a square: near the centre, at the side, in the corner.
  const PixelBox tiles[] = {{432, 324, 12, 12}, {156, 324, 12, 12}, {60, 60, 12, 12}};
  bent.sensor.windows.assign(std::begin(tiles), std::end(tiles));
  flat.sensor.windows = bent.sensor.windows;
  Parallel parallel(2);
  CaptureSettings settings;
  settings.sampler = Sampler::hemisphere;  // rays that do not depend on a region of directions
  settings.samples = 2048;
  const std::vector<double> pose(bent.axes(), 0.5);
  std::vector<float> seen(bent.sensor.pixels()), expected(seen.size()), elsewhere(seen.size());
  Camera bent_camera(bent, settings, parallel), flat_camera(flat, settings, parallel);
  MountedLens bent_lens(bent), flat_lens(flat);
  bent_camera.capture(bent_lens, pose, 3, seen.data());
  flat_camera.capture(flat_lens, pose, 3, elsewhere.data());
  for (const PixelBox& tile : tiles) {
    SceneFile at_its_height = flat;
    at_its_height.sensor.z_mm = middle_of(bent.sensor, tile).z;
    Camera camera(at_its_height, settings, parallel);
    MountedLens lens(at_its_height);
    camera.capture(lens, pose, 3, expected.data());
    int lit = 0, changed = 0;
    for (int row = tile.row; row < tile.row + tile.rows; ++row)
      for (int column = tile.column; column < tile.column + tile.columns; ++column) {
        const auto at = static_cast<std::size_t>(row * bent.sensor.width + column);
        EXPECT_EQ(seen[at], expected[at]) << column << ", " << row;
        lit += seen[at] > 0 ? 1 : 0;
        changed += seen[at] != elsewhere[at] ? 1 : 0;
      }
    EXPECT_GT(lit, 0) << tile.column;
    EXPECT_GT(changed, 0) << tile.column;
  }
}

TEST(WarpedSensor, RegionsOfDirectionsCoverAllPassingRays) {
  // As bright with rays through the region alone as with rays from everywhere.
  SceneFile scene = warped_camera();
  scene.sensor.windows = {{48, 48, 24, 24}, {888, 576, 24, 24}};
  Parallel parallel(2);
  const std::vector<double> pose(scene.axes(), 0.5);
  double mean[2] = {};
  for (const Sampler sampler : {Sampler::hemisphere, Sampler::pupil}) {
    CaptureSettings settings;
    settings.sampler = sampler;
    settings.samples = sampler == Sampler::pupil ? 256 : 16384;
    Camera camera(scene, settings, parallel);
    MountedLens lens(scene);
    std::vector<float> image(scene.sensor.pixels());
    camera.capture(lens, pose, 7, image.data());
    for (const float value : image) mean[sampler == Sampler::pupil ? 1 : 0] += static_cast<double>(value);
  }
  EXPECT_NEAR(mean[1] / mean[0], 1, 0.02);
}

TEST(WarpedSensor, FieldsHaveTheMtfOfAFlatSensorAtTheirHeight) {
  const SceneFile flat = small_camera(), bent = warped_camera();
  const optics::Assembly lens(flat.lens);
  const std::vector<double> pose(flat.axes(), 0.5);
  constexpr double kLinePairs = 60;
  double largest = 0, error = 0;
  for (const FieldPoint& point : field_points(flat)) {
    const Modulation seen = FieldMtfMeter(bent, true).modulation_at(point, lens, pose, kLinePairs);
    SceneFile at_its_height = flat;
    at_its_height.sensor.z_mm = bent.sensor.z_at(seen.x_mm, seen.y_mm);
    const Modulation expected = FieldMtfMeter(at_its_height, true).modulation_at(point, lens, pose, kLinePairs);
    const Modulation elsewhere = FieldMtfMeter(flat, true).modulation_at(point, lens, pose, kLinePairs);
    EXPECT_NEAR(seen.tangential, expected.tangential, 0.002);
    EXPECT_NEAR(seen.sagittal, expected.sagittal, 0.002);
    EXPECT_NEAR(seen.x_mm, expected.x_mm, 1e-5);
    largest = std::max(largest, std::fabs(seen.sagittal - elsewhere.sagittal));
    error = std::max(
        {error, std::fabs(seen.sagittal - expected.sagittal), std::fabs(seen.tangential - expected.tangential)});
  }
  EXPECT_GT(largest, 0.05);
  std::printf("largest difference %.5f; from the flat sensor %.3f\n", error, largest);
}

TEST(WarpedSensor, BelongsToTheContentOfAScene) {
  const SceneFile flat = small_camera();
  EXPECT_NE(scene_content_hash(flat, {}), scene_content_hash(warped_camera(), {}));
}

TEST(WarpedSensor, IsRefusedForReflectedLight) {
  CaptureSettings settings;
  settings.transport = Transport::ghost;
  Parallel parallel(1);
  EXPECT_THAT(test::error_text(ErrorKind::bad_input, [&] { Camera(warped_camera(), settings, parallel); }),
              testing::AllOf(testing::HasSubstr("'sensor_warp'"), testing::HasSubstr("use transport 'fresnel'")));
}

}  // namespace
}  // namespace relign::imaging
