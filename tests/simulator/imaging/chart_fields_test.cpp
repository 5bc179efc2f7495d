// MTF by field of the factory-like camera against rays.
#include "imaging/chart_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <set>

#include "base/error.h"
#include "imaging/field_mtf.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

using images::Direction;

const SceneFile& camera_2mp() {
  static const SceneFile scene = read_scene_file(scene_folder() + "camera_2mp/scene.json", {});
  return scene;
}

images::Image capture_of(const SceneFile& scene, const std::vector<double>& pose) {
  Parallel parallel(2);
  CaptureSettings settings;
  settings.sampler = Sampler::pupil;
  settings.samples = 48;
  Camera camera(scene, settings, parallel);
  MountedLens lens(scene);
  images::Image image(static_cast<std::size_t>(scene.sensor.width), static_cast<std::size_t>(scene.sensor.height));
  camera.capture(lens, pose, 6, image.values.data());
  return image;
}

double pixel_sinc(double x) { return x == 0 ? 1.0 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x); }

// What the image of an edge should show: rays, the square pixel, and the drawing's texels (grey by area and looked up
// bilinearly: the blur of three of them).
double mtf_by_rays(const SceneFile& scene, const std::vector<double>& pose, const ChartEdge& edge,
                   double cycles_per_pixel) {
  const optics::Assembly lens(scene.lens);
  const double aim_z = pupil_aim(scene).z_mm;
  const auto image_of = [&](double along_mm) {
    return RayBundle(scene, lens, pose, {edge.x_mm - along_mm * edge.normal_y, edge.y_mm + along_mm * edge.normal_x},
                     aim_z)
        .at(0, 0, false);
  };
  constexpr double kAlong_mm = 2;
  const RayBundle::Light one = image_of(-kAlong_mm), other = image_of(kAlong_mm);
  const double length = std::hypot(other.x_mm - one.x_mm, other.y_mm - one.y_mm);
  const double across_x = (other.y_mm - one.y_mm) / length, across_y = (one.x_mm - other.x_mm) / length;
  const double texel_px = scene.emitter.side_mm / static_cast<double>(scene.emitter.radiance.width) *
                          (length / (2 * kAlong_mm)) / scene.sensor.pitch_mm;
  const FieldMtfMeter meter(scene, true);
  const double lens_mtf = meter
                              .modulation_at({edge.x_mm, edge.y_mm, across_x, across_y}, lens, pose,
                                             cycles_per_pixel / scene.sensor.pitch_mm)
                              .tangential;
  return lens_mtf * pixel_sinc(cycles_per_pixel * across_x) * pixel_sinc(cycles_per_pixel * across_y) *
         std::pow(pixel_sinc(cycles_per_pixel * texel_px), 3);
}

TEST(ChartFields, OfTheCameraAreThirteenOnItsSensor) {
  const SceneFile& scene = camera_2mp();
  const std::vector<ChartField> fields = chart_fields(scene);
  ASSERT_EQ(fields.size(), 13u);
  std::set<std::string> names;
  for (const ChartField& chart : fields) {
    names.insert(chart.field.name);
    for (const Direction direction : {Direction::tangential, Direction::sagittal}) {
      const images::Region region = chart.field.region(direction).value();
      EXPECT_THAT(std::max(region.width, region.height), testing::Le(128u));
      EXPECT_THAT(std::min(region.width, region.height), testing::Ge(64u));
    }
  }
  EXPECT_EQ(names.size(), 13u);
  EXPECT_EQ(fields[0].field.name, "centre");
  EXPECT_NEAR(fields[0].field.mark->x_px, 959.5, 1);
  // Frequencies along the radius: on the left and the right across columns, above and below across rows.
  const auto across_columns = [](const images::Region& region) { return region.width > region.height; };
  for (const ChartField& chart : fields)
    if (chart.field.name == "left" || chart.field.name == "top") {
      EXPECT_EQ(across_columns(*chart.field.tangential), chart.field.name == "left");
      EXPECT_EQ(across_columns(*chart.field.sagittal), chart.field.name == "top");
    }
  // What a scene tells is what it reads.
  EXPECT_EQ(images::to_json(fields_of(scene)).size(), 13u);
}

TEST(ChartFields, NeedSquaresOfFortyPixels) {
  EXPECT_TRUE(chart_fields(relign_od_scene()).empty()) << "a star";
  SceneChoices choices;
  choices.target = "slanted_edges:squares=1";
  EXPECT_THAT(chart_fields(relign_od_scene_with(choices)), testing::SizeIs(1));
  choices.target = "camera_chart";
  EXPECT_TRUE(chart_fields(relign_od_scene_with(choices)).empty()) << "a few pixels";
}

// Without electronics, whose full well would cut the noise of the white squares.
TEST(ChartFields, MtfOfCapturesMatchesRaysAndPixel) {
  SceneFile scene = camera_2mp();
  scene.sensor.electronics.reset();
  const std::vector<ChartField> fields = chart_fields(scene);
  const images::EdgeFields regions = fields_of(scene);
  // The nominal pose, which is near the sharpest one, and another that is shifted by 60 pixels and out of focus.
  for (const std::vector<double>& pose :
       {std::vector<double>{0.5, 0.5, 0.5, 0.5, 0.5}, std::vector<double>{0.62, 0.42, 0.51, 0.5, 0.5}}) {
    const images::Image image = capture_of(scene, pose);
    const images::FieldEdges edges(image, regions);
    for (const auto& [f, within] : {std::pair{0.0625, 0.05}, std::pair{0.125, 0.07}, std::pair{0.25, 0.1}}) {
      double squares = 0, largest = 0;
      for (std::size_t i = 0; i < fields.size(); ++i)
        for (const Direction direction : {Direction::tangential, Direction::sagittal}) {
          const bool tangential = direction == Direction::tangential;
          const double rays = mtf_by_rays(scene, pose, tangential ? fields[i].tangential : fields[i].sagittal, f);
          const double found = edges.mtf(i, direction, f);
          EXPECT_NEAR(found, rays, within)
              << fields[i].field.name << (tangential ? ", tangential, " : ", sagittal, ") << f << " cycles/px";
          squares += (found - rays) * (found - rays) / 26;
          largest = std::max(largest, std::fabs(found - rays));
        }
      std::printf("x %.2f, z %.2f, %.4f cycles/px: deviation %.4f rms, %.4f largest\n", pose[0], pose[2], f,
                  std::sqrt(squares), largest);
    }
  }
}

// For specifications by field, which use fewer rays than the MTF at the end of a trial.
TEST(ChartFields, PointsAreImagedOntoTheMarks) {
  SceneFile scene = camera_2mp();
  const images::EdgeFields fields = fields_of(scene);
  const std::vector<FieldPoint> points = points_of_fields(scene);
  ASSERT_EQ(points.size(), fields.size());
  const FieldMtfMeter meter(scene, true, false, 40), fine(scene, true);
  const optics::Assembly lens(scene.lens);
  double largest = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Modulation found = meter.modulation_at(points[i], lens, std::vector<double>(scene.axes(), 0.5), 50);
    EXPECT_NEAR((found.x_mm - scene.sensor.left_mm) / scene.sensor.pitch_mm - 0.5, fields[i].mark->x_px, 2) << i;
    EXPECT_NEAR((scene.sensor.top_mm - found.y_mm) / scene.sensor.pitch_mm - 0.5, fields[i].mark->y_px, 2) << i;
    for (const double z : {0.5, 0.49, 0.52})
      for (const double lp_per_mm : {20.0, 50.0, 100.0}) {
        std::vector<double> pose(scene.axes(), 0.5);
        pose[2] = z;
        pose[3] = 0.55;
        const Modulation few = meter.modulation_at(points[i], lens, pose, lp_per_mm);
        const Modulation many = fine.modulation_at(points[i], lens, pose, lp_per_mm);
        largest =
            std::max({largest, std::fabs(few.tangential - many.tangential), std::fabs(few.sagittal - many.sagittal)});
      }
  }
  EXPECT_LT(largest, 0.02);
  std::printf("1,600 against 10,000 rays a point: largest difference of the MTF %.4f\n", largest);

  // A list of the same fields leads to the same points.
  scene.fields = fields;
  const std::vector<FieldPoint> listed = points_of_fields(scene);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(listed[i].x_mm, points[i].x_mm, 0.1) << "0.1 px is 0.02 mm on the chart";
    EXPECT_NEAR(listed[i].y_mm, points[i].y_mm, 0.1);
  }
  scene.fields.front().mark->x_px = 1e6;
  EXPECT_THROW(points_of_fields(scene), Error);
}

}  // namespace
}  // namespace relign::imaging
