#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "error_text.h"
#include "imaging/read_out.h"
#include "imaging/scene_file.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

using testing::AllOf;
using testing::HasSubstr;

template <class Body>
std::string refusal(Body&& body) {
  return test::error_text(ErrorKind::bad_input, body);
}

Sensor read(const std::string& text, int columns = 0, double warp_um = 0) {
  const JsonSource source = JsonSource::from_text("{\"sensor\": " + text + "}", "scene.json");
  std::vector<Problem> problems;
  const Json file = scene_schema().checked(source, "/sensor", "/properties/sensor", problems);
  const Sensor sensor = read_sensor(file, source, "/sensor", columns, warp_um, problems);
  throw_if_any(problems);
  return sensor;
}

TEST(Sensor, ReadsSquareOrColumnsAndRows) {
  const Sensor square = read(R"({"z_mm": 2, "side_mm": 5, "pixels": 100})");
  EXPECT_EQ(square.width, 100);
  EXPECT_EQ(square.height, 100);
  EXPECT_DOUBLE_EQ(square.pitch_mm, 0.05);
  const Sensor wide = read(R"({"z_mm": 2, "pitch_um": 3, "pixels": [1920, 1280]})");
  EXPECT_EQ(wide.pixels(), 1920u * 1280u);
  EXPECT_NEAR(wide.place(0, 0).x, -2.88, 1e-12);
  EXPECT_NEAR(wide.place(0, 0).y, 1.92, 1e-12);
  EXPECT_NEAR(wide.place(1920, 1280).y, -1.92, 1e-12);
  EXPECT_NEAR(wide.half_extent_mm(), 2.88, 1e-12);
}

TEST(Sensor, FewerColumnsCoverTheSameArea) {
  const Sensor coarse = read(R"({"z_mm": 2, "pitch_um": 3, "pixels": [1920, 1280]})", 192);
  EXPECT_EQ(coarse.width, 192);
  EXPECT_EQ(coarse.height, 128);
  EXPECT_NEAR(coarse.pitch_mm, 0.03, 1e-12);
  EXPECT_NEAR(coarse.place(192, 128).y, -1.92, 1e-12);
}

TEST(Sensor, WarpIsThatOfTheWholeSensor) {
  for (const char* region : {"", R"(, "region": {"column": 150, "row": 0})"}) {
    const Sensor sensor =
        read(R"({"z_mm": 2, "pitch_um": 10, "pixels": [200, 100])" + std::string(region) + "}", 0, -8);
    EXPECT_NEAR(sensor.place(sensor.width, 0).z, 2 - 0.008, 1e-12);
    EXPECT_NEAR(sensor.z_at(0, 0), 2, 1e-12);
  }
}

TEST(Sensor, RegionSelectsPartOfTheSensor) {
  const Sensor part = read(R"({"z_mm": 2, "pitch_um": 10, "pixels": [200, 100],
                               "region": {"column": 150, "row": 20, "rows": 30}})");
  EXPECT_EQ(part.width, 50);
  EXPECT_EQ(part.height, 30);
  EXPECT_NEAR(part.place(0, 0).x, 0.5, 1e-12);
  EXPECT_NEAR(part.place(0, 0).y, 0.3, 1e-12);
}

TEST(Sensor, ReportsMistakesWithPosition) {
  EXPECT_THAT(refusal([] { read(R"({"z_mm": 2, "pitch_um": 3, "pixels": [0, 4]})"); }),
              AllOf(HasSubstr("/sensor/pixels"), HasSubstr("from 1 to 16384")));
  EXPECT_THAT(refusal([] { read(R"({"z_mm": 2, "pixels": [4, 4]})"); }), HasSubstr("pitch_um"));
  EXPECT_THAT(refusal([] { read(R"({"z_mm": 2, "pitch_um": 3, "pixels": [10000, 10000]})"); }),
              HasSubstr("64 million"));
  EXPECT_THAT(refusal([] { read(R"({"z_mm": 2, "pitch_um": 3, "side_mm": 1, "pixels": 5})"); }),
              HasSubstr("[columns, rows]"));
  EXPECT_THAT(
      refusal([] { read(R"({"z_mm": 2, "side_mm": 1, "pixels": 10, "region": {"column": 8, "columns": 5}})"); }),
      HasSubstr("ends at column 13"));
  EXPECT_THAT(refusal([] { read(R"({"z_mm": 2, "side_mm": 1, "region": {"row": 3}})", 20); }),
              HasSubstr("the pixels of the file"));
  EXPECT_THAT(refusal([] { read(R"({"z_mm": 2, "side_mm": 1, "electronics": {"saturation": 0.1, "bits": 20}})"); }),
              AllOf(HasSubstr("full_well_electrons"), HasSubstr("bits")));
}

// A wide sensor and a region of it see what the paper's sensor sees there.
TEST(Sensor, RegionsMatchTheWholeImage) {
  Parallel parallel(2);
  const auto render = [&](const SceneFile& scene) {
    Camera camera(scene, {}, parallel);
    MountedLens lens(scene);
    std::vector<float> image(scene.sensor.pixels());
    camera.render_noise_free(lens, {0.55, 0.45, 0.5, 0.52, 0.5}, 1, 1024, image.data());
    return image;
  };
  const std::vector<float> whole = render(relign_od_scene());
  SceneFile part = relign_od_scene();
  part.sensor.left_mm += 30 * part.sensor.pitch_mm;
  part.sensor.top_mm -= 50 * part.sensor.pitch_mm;
  part.sensor.width = 150;
  part.sensor.height = 70;
  const std::vector<float> seen = render(part);
  const auto difference = [&](std::size_t shift) {
    double squares = 0;
    for (std::size_t row = 0; row < 70; ++row)
      for (std::size_t column = 0; column < 150; ++column) {
        const float theirs = whole[(row + 50) * 200 + column + 30 + shift];
        squares += std::pow(static_cast<double>(seen[row * 150 + column] - theirs), 2) / (70 * 150);
      }
    return std::sqrt(squares);
  };
  EXPECT_LT(difference(0), 0.001);
  EXPECT_GT(difference(1), 0.004);
}

constexpr int kCount = 100000;

std::vector<float> read_out_of(float irradiance, const Electronics& electronics, ShotNoise noise, std::uint64_t seed) {
  std::vector<float> pixels(kCount, irradiance);
  optics::RayBlock space;
  read_out(electronics, noise, seed, 0, kCount, pixels.data(), space);
  return pixels;
}

struct Moments {
  double mean = 0, variance = 0;
};

Moments moments(const std::vector<float>& values) {
  Moments found;
  for (const float value : values) found.mean += static_cast<double>(value) / kCount;
  for (const float value : values) found.variance += std::pow(static_cast<double>(value) - found.mean, 2) / kCount;
  return found;
}

TEST(ReadOut, AddsShotNoiseAndReadNoise) {
  Electronics electronics;
  electronics.saturation = 0.2;
  electronics.full_well_electrons = 10000;
  electronics.read_noise_electrons = 20;
  const double unit = 0.2 / 10000;
  // 4,000 electrons: variance 4,000 + 400.
  const Moments added = moments(read_out_of(0.08F, electronics, ShotNoise::added, 7));
  EXPECT_NEAR(added.mean, 0.08, 4 * std::sqrt(4400.0 / kCount) * unit);
  EXPECT_NEAR(added.variance / (unit * unit), 4400, 4400 * 0.02);
  const Moments own = moments(read_out_of(0.08F, electronics, ShotNoise::sampled, 7));
  EXPECT_NEAR(own.variance / (unit * unit), 400, 400 * 0.02);
}

TEST(ReadOut, ClampsToZeroAndFullWell) {
  Electronics electronics;
  electronics.saturation = 0.1;
  electronics.full_well_electrons = 5000;
  electronics.read_noise_electrons = 3;
  for (const float value : read_out_of(0.5F, electronics, ShotNoise::added, 1)) ASSERT_EQ(value, 0.1F);
  float lowest = 1;
  for (const float value : read_out_of(0, electronics, ShotNoise::added, 1)) lowest = std::min(lowest, value);
  EXPECT_EQ(lowest, 0);
}

TEST(ReadOut, QuantisesToConverterBits) {
  Electronics electronics;
  electronics.saturation = 1;
  electronics.full_well_electrons = 100;
  electronics.bits = 3;
  std::vector<int> seen(8, 0);
  for (const float value : read_out_of(0.5F, electronics, ShotNoise::added, 1)) {
    const double step = static_cast<double>(value) * 7;
    ASSERT_NEAR(step, std::round(step), 1e-6);
    ++seen[static_cast<std::size_t>(std::lround(step))];
  }
  EXPECT_GT(seen[3], 1000);
  EXPECT_GT(seen[4], 1000);
}

TEST(ReadOut, DependsOnlyOnTheSeed) {
  SceneFile scene = relign_od_scene();
  scene.sensor.electronics = Electronics{0.15, 8000, 4, 10};
  CaptureSettings settings;
  settings.sampler = Sampler::pupil;
  settings.samples = 4;
  const auto capture = [&](unsigned threads, std::uint64_t seed) {
    Parallel parallel(threads);
    Camera camera(scene, settings, parallel);
    MountedLens lens(scene);
    std::vector<float> image(scene.sensor.pixels());
    camera.capture(lens, nominal_pose(), seed, image.data());
    return image;
  };
  const std::vector<float> one = capture(1, 5);
  EXPECT_EQ(one, capture(3, 5));
  EXPECT_NE(one, capture(1, 6));
}

}  // namespace
}  // namespace relign::imaging
