// Lateral colour at edges and fine lines, in images and MTF, against exact rays.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/files.h"
#include "imaging/diffraction.h"
#include "imaging/field_mtf.h"
#include "imaging/ray_bundle.h"
#include "wavelengths_under_test.h"

namespace relign::imaging {
namespace {

constexpr double kEdge_mm = 90;  // off the axis, on the emitter

// A singlet of BK7 behind a small stop, 50 mm f/62: sharp, with much lateral colour. Its sensor has 300 x 20 pixels of
// 10 um around the image of an edge.
SceneFile singlet() {
  const std::filesystem::path folder = testing::TempDir();
  const std::string name = "singlet_" + std::to_string(::getpid());
  write_file_atomically(folder / (name + "_lens.json"), R"({
    "name": "singlet", "wavelength_nm": 550, "image_z_mm": 55, "glasses": {"crown": {"nd": 1.5168, "vd": 64.17}},
    "elements": [{"name": "L1", "faces": [
      {"z_mm": 0, "radius_mm": 51.68, "glass_after": "crown", "clear_radius_mm": 12},
      {"z_mm": 4, "radius_mm": -51.68, "clear_radius_mm": 12}]}],
    "stops": [{"name": "stop", "z_mm": -25, "opening_radius_mm": 0.4, "aperture": true}]})");
  write_file_atomically(folder / (name + ".json"), R"({
    "use": "lens_system", "name": "singlet", "lens": ")" +
                                                       name + R"(_lens.json",
    "pivot_behind_first_vertex_mm": 2, "travel": {},
    "sensor": {"z_mm": 53, "pixels": [2400, 2400], "pitch_um": 10,
               "region": {"column": 80, "row": 1190, "columns": 300, "rows": 20}},
    "emitter": {"z_mm": -500, "side_mm": 200, "target": "white", "texels": 2},
    "wavelengths": [{"nm": 450, "weight": 1}, {"nm": 650, "weight": 2}]})");
  SceneFile scene = read_scene_file(folder / (name + ".json"), {});
  for (const char* end : {"_lens.json", ".json"}) std::filesystem::remove(folder / (name + end));
  constexpr std::size_t kTexels = 2000;
  images::Image half(kTexels, kTexels);
  for (std::size_t y = 0; y < kTexels; ++y)
    for (std::size_t x = 0; x < kTexels; ++x) half.at(x, y) = x < kTexels * (100 + kEdge_mm) / 200 ? 1.0F : 0.0F;
  scene.emitter.show(half);
  return scene;
}

// Columns (0: the left rim of the first) where the light of the edge's place arrives on average.
double exact_column(const SceneFile& scene, const optics::Prescription& lens) {
  const PupilAim aim = pupil_aim(scene);
  const optics::Assembly assembly(lens);
  const RayBundle bundle(scene, assembly, nominal_pose(), {kEdge_mm, 0}, aim.z_mm);
  const Window window = passing_window(bundle, aim);
  constexpr int kRays = 60;
  double sum = 0, light = 0;
  for (int i = 0; i < kRays; ++i)
    for (int j = 0; j < kRays; ++j) {
      const RayBundle::Light ray = bundle.at(window.low_u + (window.high_u - window.low_u) * (i + 0.5) / kRays,
                                             window.low_v + (window.high_v - window.low_v) * (j + 0.5) / kRays, true);
      sum += ray.weight * ray.x_mm;
      light += ray.weight;
    }
  return (sum / light - scene.sensor.left_mm) / scene.sensor.pitch_mm;
}

TEST(LateralColour, TwoWavelengthsSplitAnEdgeAsExactRaysDo) {
  const SceneFile scene = singlet();
  Parallel parallel(2);
  Camera camera(scene, {}, parallel);
  MountedLens lens(scene);
  std::vector<float> image(scene.sensor.pixels());
  camera.render_noise_free(lens, nominal_pose(), 1, 1024, image.data());
  const int width = scene.sensor.width;
  std::vector<double> profile(static_cast<std::size_t>(width));
  for (std::size_t at = 0; at < image.size(); ++at)
    profile[at % profile.size()] += static_cast<double>(image[at]) / scene.sensor.height;
  const double blue = exact_column(scene, scene.wavelengths[0].lens);
  const double red = exact_column(scene, scene.wavelengths[1].lens);
  std::printf("exact rays: 450 nm at column %.2f, 650 nm at %.2f\n", blue, red);
  ASSERT_GT(std::fabs(blue - red), 8);
  const bool blue_first = blue < red;
  const double first = std::min(blue, red), second = std::max(blue, red);
  const auto level = [&](double column) { return profile[static_cast<std::size_t>(column)]; };
  const double dark = level(first - 20), between = level((first + second) / 2), bright = level(second + 20);
  EXPECT_EQ(dark, 0);
  EXPECT_NEAR(between / bright, blue_first ? 1 / 3.0 : 2 / 3.0, 0.01);
  const auto crossing = [&](double wanted) {
    std::size_t i = 0;
    while (profile[i + 1] < wanted) ++i;
    return static_cast<double>(i) + 0.5 + (wanted - profile[i]) / (profile[i + 1] - profile[i]);
  };
  const double found_first = crossing((dark + between) / 2), found_second = crossing((between + bright) / 2);
  std::printf("image: steps at columns %.2f and %.2f, level between them %.4f\n", found_first, found_second,
              between / bright);
  EXPECT_NEAR(found_first, first, 0.15);
  EXPECT_NEAR(found_second, second, 0.15);
}

// Lines whose two colours are half a period apart lose modulation according to the weights.
TEST(LateralColour, ReducesMtfByPhaseDifference) {
  SceneFile scene = singlet();
  const FieldPoint point{kEdge_mm, 0, 1, 0};
  const optics::Assembly perfect(scene.lens);
  const double apart_mm =
      std::fabs(exact_column(scene, scene.wavelengths[0].lens) - exact_column(scene, scene.wavelengths[1].lens)) *
      scene.sensor.pitch_mm;
  scene.emitter.show(images::Image(2, 2, 1.0F));
  const FieldMtfMeter meter(scene, true);
  for (const double lp_per_mm : {0.1 / apart_mm, 0.5 / apart_mm, 1 / apart_mm}) {
    double kept[2];
    for (std::size_t i = 0; i < 2; ++i) {
      SceneFile single = scene;
      single.wavelengths.clear();
      single.lens = scene.wavelengths[i].lens;
      kept[i] = FieldMtfMeter(single, true)
                    .modulation_at(point, optics::Assembly(single.lens), nominal_pose(), lp_per_mm)
                    .tangential;
    }
    const double turn = 2 * 3.14159265358979 * lp_per_mm * apart_mm;
    const double x = kept[0] / 3 + 2 * kept[1] / 3 * std::cos(turn), y = 2 * kept[1] / 3 * std::sin(turn);
    const double found = meter.modulation_at(point, perfect, nominal_pose(), lp_per_mm).tangential;
    std::printf("%.1f lp/mm: one wavelength each %.4f and %.4f, both %.4f, by their phases %.4f\n", lp_per_mm, kept[0],
                kept[1], found, std::hypot(x, y));
    EXPECT_NEAR(found, std::hypot(x, y), 0.01) << lp_per_mm;
  }
}

// With hardly any diffraction (a thousandth of the wavelengths, the same indices) wave optics agrees with rays: phases
// of all wavelengths refer to one point.
TEST(LateralColour, WavesOfShortWavelengthsAgreeWithRays) {
  double largest = 0;
  const auto hold = [&](SceneFile scene, const std::vector<FieldPoint>& points, double lp_per_mm) {
    for (SceneWavelength& one : scene.wavelengths) one.lens.wavelength_nm *= 1e-3;
    const optics::Assembly perfect(scene.lens);
    const std::vector<double> pose(scene.axes(), 0.5);
    for (const FieldPoint& point : points) {
      const Modulation rays = FieldMtfMeter(scene, true).modulation_at(point, perfect, pose, lp_per_mm);
      const Modulation waves = FieldMtfMeter(scene, true, true).modulation_at(point, perfect, pose, lp_per_mm);
      EXPECT_NEAR(rays.tangential, waves.tangential, 0.01) << scene.name << lp_per_mm;
      EXPECT_NEAR(rays.sagittal, waves.sagittal, 0.01) << scene.name << lp_per_mm;
      largest =
          std::max({largest, std::fabs(rays.tangential - waves.tangential), std::fabs(rays.sagittal - waves.sagittal)});
    }
  };
  for (const double lp_per_mm : {2.0, 5.0, 10.0}) hold(singlet(), {{kEdge_mm, 0, 1, 0}}, lp_per_mm);
  for (const char* name : {"cooke_triplet", "petzval", "tessar"}) {
    const SceneFile scene = scene_with_wavelengths(name, kThreeWavelengths);
    const auto points = field_points(scene);
    hold(scene, {points[0], points[1]}, 20);
  }
  std::printf("largest deviation of waves from rays: %.4f\n", largest);
}

// Kernels of diffraction: the mean of those of one wavelength.
TEST(LateralColour, DiffractionKernelsAreMeansOverWavelengths) {
  const auto scene_at = [](const std::string& list) {
    SceneFile scene = scene_with_wavelengths("cooke_triplet", list, 40);
    scene.sensor.pitch_mm /= 400;  // 2.6 um
    scene.sensor.left_mm /= 400;
    scene.sensor.top_mm /= 400;
    scene.pupil.reset();
    return scene;
  };
  const Diffraction all(scene_at(R"([{"nm": 450, "weight": 1}, {"nm": 700, "weight": 3}])"));
  const Diffraction blue(scene_at(R"([{"nm": 450}])")), red(scene_at(R"([{"nm": 700}])"));
  double largest = 0;
  for (const double cycles : {0.05, 0.1, 0.2, 0.3, 0.4, 0.5})
    for (const double place : {0.0, 20.0, 40.0}) {
      const double mean = 0.25 * blue.transfer(place, 20, cycles, 0) + 0.75 * red.transfer(place, 20, cycles, 0);
      largest = std::max(largest, std::fabs(all.transfer(place, 20, cycles, 0) - mean));
      EXPECT_NEAR(all.transfer(place, 20, cycles, 0), mean, 0.02) << cycles << " at " << place;
    }
  EXPECT_GT(blue.transfer(20, 20, 0.3, 0), red.transfer(20, 20, 0.3, 0) + 0.05);
  std::printf("largest deviation of kernels: %.4f\n", largest);
}

}  // namespace
}  // namespace relign::imaging
