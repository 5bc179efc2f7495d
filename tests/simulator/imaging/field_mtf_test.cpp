// MTF at points of the field, against a closed form and against independently traced rays.
#include "imaging/field_mtf.h"

#include <gtest/gtest.h>

#include <cmath>

#include "exact_rays.h"
#include "hyperboloids.h"
#include "optics/first_order.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

// Bessel's function of the first kind and order, by its integral: std::cyl_bessel_j is not in every C++ library.
double bessel_j1(double x) {
  constexpr int kSteps = 2000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double angle = kPi * (i + 0.5) / kSteps;
    sum += std::cos(angle - x * std::sin(angle));
  }
  return sum / kSteps;
}

double disc_mtf(double x) { return x < 1e-9 ? 1 : std::fabs(2 * bessel_j1(x) / x); }

TEST(FieldMtf, DefocusMatchesUniformDisc) {
  SceneFile scene = hyperbolic_scene();
  const optics::Assembly lens(scene.lens);
  const double tangent = kStopRadius_mm / kFocus_mm;
  double largest = 0;
  for (const double off_mm : {0.0, 0.5, -1.0, 2.0}) {
    scene.sensor.z_mm = 10 + kFocus_mm + off_mm;
    const FieldMtfMeter meter(scene, false);
    for (const double lp_per_mm : {5.0, 10.0, 20.0, 40.0}) {
      const double x = 2 * kPi * lp_per_mm * tangent * std::fabs(off_mm);
      const FieldMtf found = meter.measure(lens, nominal_pose(), lp_per_mm);
      EXPECT_NEAR(found.centre, disc_mtf(x), 0.003) << off_mm << " mm, " << lp_per_mm << " lp/mm, x " << x;
      EXPECT_NEAR(found.corner, disc_mtf(x), 0.008) << "the field is so small that its corners are its centre; four "
                                                       "points, two directions, the lowest of eight";
      largest = std::max(largest, std::fabs(found.centre - disc_mtf(x)));
    }
  }
  std::printf("largest deviation from 2 J1(x) / x: %.5f\n", largest);
}

TEST(FieldMtf, StrongBlurHasNoGratingArtefact) {
  SceneFile scene = hyperbolic_scene();
  scene.sensor.z_mm += 5;
  const FieldMtfMeter meter(scene, false);
  for (const double lp_per_mm : {100.0, 300.0, 375.0, 400.0, 800.0})
    EXPECT_LT(meter.measure(optics::Assembly(scene.lens), nominal_pose(), lp_per_mm).centre, 0.06) << lp_per_mm;
}

// The lower of both directions, from rays on another grid with their own transmittances.
double modulation(const SceneFile& scene, const optics::Assembly& lens, const std::vector<double>& pose,
                  const FieldPoint& point, double lp_per_mm) {
  double light = 0, sums[2][2] = {};
  for_bundle(scene, lens, pose, {point.x_mm, point.y_mm, scene.emitter.z_mm},
             [&](const optics::Vec3& hit, double weight) {
               light += weight;
               for (int direction = 0; direction < 2; ++direction) {
                 const double along = direction == 0 ? point.radial_x * hit.x + point.radial_y * hit.y
                                                     : point.radial_x * hit.y - point.radial_y * hit.x;
                 sums[direction][0] += weight * std::cos(2 * kPi * lp_per_mm * along);
                 sums[direction][1] += weight * std::sin(2 * kPi * lp_per_mm * along);
               }
             });
  return std::min(std::hypot(sums[0][0], sums[0][1]), std::hypot(sums[1][0], sums[1][1])) / light;
}

TEST(FieldMtf, MatchesRaysOfThePapersLens) {
  const SceneFile& scene = relign_od_scene();
  // Its target reaches as far as the full field of 42.05 degrees, and all of it is imaged.
  const double corner_mm = 0.8 * scene.emitter.side_mm / 2;
  const std::array<FieldPoint, 5> points = field_points(scene);
  EXPECT_EQ(points[0].x_mm, 0);
  EXPECT_EQ(points[0].y_mm, 0);
  for (std::size_t corner = 1; corner < 5; ++corner) {
    EXPECT_NEAR(std::fabs(points[corner].x_mm), corner_mm, 1e-9);
    EXPECT_NEAR(std::fabs(points[corner].y_mm), corner_mm, 1e-9);
  }
  const FieldMtfMeter meter(scene, true);
  Random random(5);
  const optics::Assembly perfect(scene.lens), built = random_assembly(random);
  double largest = 0;
  for (const optics::Assembly* lens : {&perfect, &built})
    for (const std::vector<double>& pose :
         {std::vector<double>{0.5, 0.5, 0.5, 0.5, 0.5}, std::vector<double>{0.5, 0.5, 0.48, 0.5, 0.5},
          std::vector<double>{0.52, 0.47, 0.51, 0.6, 0.45}})
      for (const double lp_per_mm : {5.0, 10.0, 20.0, 40.0}) {
        FieldMtf exact{modulation(scene, *lens, pose, points[0], lp_per_mm), 1};
        for (std::size_t corner = 1; corner < 5; ++corner)
          exact.corner = std::min(exact.corner, modulation(scene, *lens, pose, points[corner], lp_per_mm));
        const FieldMtf found = meter.measure(*lens, pose, lp_per_mm);
        std::printf("%s lens, z %.2f, Rx %.2f, %2.0f lp/mm: centre %.4f (rays %.4f), corner %.4f (rays %.4f)\n",
                    lens == &perfect ? "perfect" : "built  ", pose[2], pose[3], lp_per_mm, found.centre, exact.centre,
                    found.corner, exact.corner);
        EXPECT_NEAR(found.centre, exact.centre, 0.006) << lp_per_mm;
        EXPECT_NEAR(found.corner, exact.corner, 0.006) << lp_per_mm;
        largest = std::max({largest, std::fabs(found.centre - exact.centre), std::fabs(found.corner - exact.corner)});
      }
  std::printf("largest deviation %.4f\n", largest);
}

TEST(FieldMtf, DependsOnlyOnItsArguments) {
  const SceneFile& scene = relign_od_scene();
  Random random(6);
  const optics::Assembly lens = random_assembly(random);
  const FieldMtfMeter one(scene, true), other(scene, true);
  const std::vector<double> pose = random_pose(random, 0.45, 0.55);
  const FieldMtf first = one.measure(lens, pose, 20);
  one.measure(lens, nominal_pose(), 40);
  const FieldMtf again = one.measure(lens, pose, 20), elsewhere = other.measure(lens, pose, 20);
  EXPECT_EQ(first.centre, again.centre);
  EXPECT_EQ(first.corner, again.corner);
  EXPECT_EQ(first.centre, elsewhere.centre);
  EXPECT_EQ(first.corner, elsewhere.corner);
}

TEST(FieldMtf, TiltLowersTheCorners) {
  const SceneFile& scene = relign_od_scene();
  const FieldMtfMeter meter(scene, true);
  const optics::Assembly lens(scene.lens);
  const FieldMtf straight = meter.measure(lens, nominal_pose(), 20);
  const FieldMtf tilted = meter.measure(lens, {0.5, 0.5, 0.5, 0.7, 0.5}, 20);
  EXPECT_LT(tilted.corner, straight.corner - 0.1);
  EXPECT_GT(tilted.centre, tilted.corner);
}

TEST(FieldMtf, IsZeroWithoutLight) {
  SceneFile scene = relign_od_scene();
  scene.lens.stops.push_back({"lid", scene.lens.elements.front().faces.front().z_mm - 0.1, 1e-6, false, false});
  const FieldMtf found =
      FieldMtfMeter(scene, true).measure(optics::Assembly(scene.lens), {0.9, 0.1, 0.5, 0.9, 0.1}, 20);
  EXPECT_EQ(found.centre, 0);
  EXPECT_EQ(found.corner, 0);
}

TEST(FieldMtf, UsesTheFieldOfTheSensorRegion) {
  SceneFile scene = relign_od_scene();
  scene.sensor.width = 100;  // its left half
  const std::array<FieldPoint, 5> points = field_points(scene);
  const optics::FirstOrder data = optics::first_order(scene.lens);
  EXPECT_GT(points[0].x_mm, 0) << "images are inverted";
  for (std::size_t corner = 1; corner < 5; ++corner) EXPECT_GT(points[corner].x_mm, 0);
  EXPECT_NEAR(points[0].y_mm, 0, 1e-9);
  EXPECT_GT(data.focal_length, 0);
  scene.sensor.left_mm = 50;
  EXPECT_THROW(field_points(scene), Error);
}

// MTF of each design at its optimum at a quarter of its sensor's limit: all have light at every field point.
TEST(FieldMtf, EveryShippedSceneHasLightAtItsCorners) {
  for (const std::string& name : shipped_scenes()) {
    const SceneFile scene = read_scene_file(scene_folder() + name + "/scene.json", {});
    const double lp_per_mm = 0.125 / scene.sensor.pitch_mm;
    const FieldMtf found = FieldMtfMeter(scene, true).measure(optics::Assembly(scene.lens), nominal_pose(), lp_per_mm);
    std::printf("%-20s %6.2f lp/mm: centre %.3f, corner %.3f\n", name.c_str(), lp_per_mm, found.centre, found.corner);
    EXPECT_GT(found.centre, 0.3) << name;
    EXPECT_GT(found.corner, 0.02) << name;
  }
}

}  // namespace
}  // namespace relign::imaging
