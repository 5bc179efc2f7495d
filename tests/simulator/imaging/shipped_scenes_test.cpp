// Shipped scenes: each lens against published values, its focus, its light, and the consistency of its files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/files.h"
#include "optics/named_values.h"
#include "optics/trace.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

using optics::Vec3;

// All but camera_2mp: its image fills a rectangular sensor and its target is a chart, not a star.
std::vector<std::string> library() {
  std::vector<std::string> names = shipped_scenes();
  names.erase(std::remove(names.begin(), names.end(), "camera_2mp"), names.end());
  return names;
}

class ShippedScene : public testing::TestWithParam<std::string> {
 protected:
  std::string folder() const { return scene_folder() + GetParam() + "/"; }
  SceneFile scene(int pixels = 0) const {
    SceneChoices choices;
    choices.pixels = pixels;
    return read_scene_file(folder() + "scene.json", choices);
  }
  // The authors' package has no corrected lens in these two.
  bool corrected() const { return GetParam() != "relign_l2" && GetParam() != "relign_l3"; }
};

// The published number as the file writes it, for the sake of its last digit.
int decimals_of(const std::string& lens_file, const std::string& name) {
  const auto at = lens_file.find(":", lens_file.find("\"" + name + "\"", lens_file.find("\"published\"")));
  const auto end = lens_file.find_first_not_of(" -.0123456789", at + 1);
  const std::string number = lens_file.substr(at + 1, end - at - 1);
  const auto point = number.find('.');
  EXPECT_NE(point, std::string::npos) << name;
  return static_cast<int>(number.find_last_of("0123456789") - point);
}

TEST_P(ShippedScene, MatchesPublishedFirstOrderValues) {
  const optics::Prescription lens = optics::read_prescription(folder() + "lens.json");
  const std::map<std::string, double> ours = optics::named_values(optics::first_order(lens));
  EXPECT_EQ(lens.published.empty(), !corrected()) << "nothing is published of the package's simple lenses";
  const std::string text = read_file(folder() + "lens.json");
  for (const optics::Published& published : lens.published) {
    // Half a unit of the last printed digit, and a little for the rounding of two programs.
    const double unit = std::pow(10.0, -decimals_of(text, published.name));
    EXPECT_NEAR(ours.at(published.name), published.value, 0.56 * unit) << published.name;
  }
}

struct Spot {
  int rays = 0;
  double x = 0, y = 0, rms = 0;  // mm
};

// Light of one place of the emitter (shares of its half side) on the sensor of the nominal pose.
Spot spot(const SceneFile& scene, double share_x, double share_y) {
  const optics::Assembly assembly(scene.lens);
  const optics::FirstOrder data = optics::first_order(scene.lens);
  const double half = scene.emitter.side_mm / 2, pivot = scene.pivot_behind_first_vertex_mm;
  const Vec3 from{share_x * half, share_y * half, scene.emitter.z_mm + pivot};
  const double reach = 0.8 * data.entrance_pupil_diameter;
  const double first = scene.lens.elements.front().faces.front().z_mm;
  std::vector<Vec3> hits;
  constexpr int kAcross = 40;
  for (int i = 0; i <= kAcross; ++i)
    for (int j = 0; j <= kAcross; ++j) {
      const Vec3 to{reach * (2.0 * i / kAcross - 1), reach * (2.0 * j / kAcross - 1), first + data.entrance_pupil_z};
      const optics::TracedRay traced = optics::trace(assembly, {from, to - from}, optics::Apertures::mesh);
      if (!traced.passed) continue;
      const double further = (scene.sensor.z_mm + pivot - scene.lens.image_z_mm) / traced.exit_direction.z;
      hits.push_back(traced.image + further * traced.exit_direction);
    }
  Spot result;
  result.rays = static_cast<int>(hits.size());
  for (const Vec3& hit : hits) {
    result.x += hit.x / result.rays;
    result.y += hit.y / result.rays;
  }
  for (const Vec3& hit : hits) result.rms += std::pow(hit.x - result.x, 2) + std::pow(hit.y - result.y, 2);
  result.rms = std::sqrt(result.rms / result.rays);
  return result;
}

TEST_P(ShippedScene, IsInFocusAndStaysOnTheSensor) {
  const SceneFile given = scene();
  for (const double share : {0.0, 0.5, 0.9}) {
    const Spot found = spot(given, share, share);
    ASSERT_GT(found.rays, 100) << share;
    if (!corrected()) continue;
    // Also at the full sideways travel.
    EXPECT_LT(std::fabs(found.x) + given.travel.shift_mm[0], given.sensor.half_extent_mm());
    EXPECT_LT(found.rms, 0.6 * given.sensor.pitch_mm) << "at " << share << " of the corner";
  }
}

TEST_P(ShippedScene, IsLitWhereTheTargetIsWhite) {
  SceneFile given = scene(100);
  Parallel parallel(1);
  Camera camera(given, {}, parallel);
  MountedLens lens(given);
  std::vector<float> image(100 * 100);
  camera.render_noise_free(lens, nominal_pose(), 1, 64, image.data());
  std::vector<float> sorted = image;
  std::sort(sorted.begin(), sorted.end());
  const float white = sorted[sorted.size() * 99 / 100];
  const auto lit = std::count_if(image.begin(), image.end(), [&](float value) { return value > 0.3F * white; });
  EXPECT_GT(white, 0.005F);
  EXPECT_GT(lit, 1000);
  EXPECT_LT(lit, 5000);
  for (std::size_t i = 0; i < 100; ++i)
    for (const std::size_t border : {i, 9900 + i, 100 * i, 100 * i + 99}) EXPECT_LT(image[border], 0.2F * white);
  if (!corrected()) return;
  // The star: where a place of the emitter is imaged, the image is as bright or dark as the target is there.
  int right = 0, asked = 0;
  const std::size_t texels = given.emitter.radiance.width;
  for (double x = -0.85; x < 0.9; x += 0.17)
    for (double y = -0.85; y < 0.9; y += 0.17) {
      if (x * x + y * y < 0.1) continue;  // the sectors are narrow in the middle
      const auto texel = [&](double share) {
        return static_cast<std::size_t>((share + 1) / 2 * static_cast<double>(texels));
      };
      // Near an edge between sectors the pixel is grey.
      const float target = given.emitter.radiance.at(texel(x), texel(y));
      bool even = true;
      for (const double dx : {-0.03, 0.03})
        for (const double dy : {-0.03, 0.03})
          even = even && given.emitter.radiance.at(texel(x + dx), texel(y + dy)) == target;
      if (!even) continue;
      const Spot found = spot(given, x, y);
      const auto column = static_cast<std::size_t>((found.x + given.sensor.half_extent_mm()) / given.sensor.pitch_mm);
      const auto row = static_cast<std::size_t>((given.sensor.half_extent_mm() - found.y) / given.sensor.pitch_mm);
      ++asked;
      right += (image[row * 100 + column] > 0.15F * white) == (target > 0.5F) ? 1 : 0;
    }
  EXPECT_GT(asked, 10);
  EXPECT_EQ(right, asked);
}

// The spec of a shipped scene is the RMSE of an image that is off by one pixel sideways.
TEST_P(ShippedScene, SpecificationIsRmseOfOnePixelShift) {
  const SceneFile given = scene();
  ASSERT_TRUE(given.spec.is_object() && given.spec.contains("rmse"));
  Parallel parallel(1);
  const Reference reference = make_reference(given, {}, parallel, {}, nullptr);
  Camera camera(given, {}, parallel);
  MountedLens lens(given);
  std::vector<double> pose = nominal_pose();
  pose[0] += 0.5 * given.sensor.pitch_mm / given.travel.shift_mm[0];
  const double rmse = std::sqrt(std::max(0.0, camera.noise_free_mse(lens, pose, 5, reference).mse));
  EXPECT_NEAR(given.spec.at("rmse").get<double>() / rmse, 1, 0.06) << "RMSE " << rmse;
}

TEST_P(ShippedScene, TolerancesFitTheScene) {
  const SceneFile given = scene();
  EXPECT_TRUE(given.machine_time.is_object());
  const Json tolerances = Json::parse(read_file(folder() + "tolerances.json"));
  EXPECT_EQ(tolerances.at("use"), "tolerances");
  std::vector<std::string> elements, toleranced;
  for (const optics::Element& element : given.lens.elements) elements.push_back(element.name);
  for (const auto& [name, limits] : tolerances.at("elements").items()) toleranced.push_back(name);
  EXPECT_THAT(toleranced, testing::UnorderedElementsAreArray(elements));
  for (std::size_t axis = 0; axis < 3; ++axis)
    EXPECT_LT(tolerances.at("start").at("shift_um").at(axis).get<double>() / 1000, given.travel.shift_mm[axis]);
  for (std::size_t axis = 0; axis < 2; ++axis)
    EXPECT_LT(tolerances.at("start").at("tilt_arcmin").at(axis).get<double>() / 60, given.travel.tilt_deg[axis]);
}

INSTANTIATE_TEST_SUITE_P(Shipped, ShippedScene, testing::ValuesIn(library()),
                         [](const auto& scene) { return scene.param; });

}  // namespace
}  // namespace relign::imaging
