// MTF with diffraction: against the closed form of a circular pupil, against an integral of a defocused one, and
// against the geometric MTF where waves are short.
#include <gtest/gtest.h>

#include <cmath>

#include "hyperboloids.h"
#include "imaging/field_mtf.h"
#include "optics/pi.h"
#include "optics/trace.h"
#include "scene_under_test.h"

namespace relign::imaging::diffraction_mtf {
namespace {

using optics::kPi;
const double kSine = kStopRadius_mm / std::hypot(kStopRadius_mm, kFocus_mm);  // of the marginal ray
constexpr double kWavelength_mm = 550e-6;

double circular_pupil_mtf(double s) { return s < 1 ? 2 / kPi * (std::acos(s) - s * std::sqrt(1 - s * s)) : 0; }

TEST(OpticalPath, IsEqualForAllRaysOfAPerfectLens) {
  const SceneFile scene = hyperbolic_scene();
  const optics::Assembly lens(scene.lens);
  const double on_axis = kFocus_mm + 10 * kIndex + kFocus_mm;
  double largest = 0;
  for (const double height : {0.0, 0.3, -1.1, 1.9}) {
    const optics::TracedRay ray =
        optics::trace(lens, {{0, 0, -kFocus_mm}, {height, 0.2, kFocus_mm}}, optics::Apertures::none);
    ASSERT_TRUE(ray.passed) << ray.lost_at;
    EXPECT_NEAR(ray.optical_path_mm, on_axis, 1e-11) << height;
    largest = std::max(largest, std::fabs(ray.optical_path_mm - on_axis));
  }
  std::printf("largest difference of paths: %.1e mm\n", largest);
}

TEST(DiffractionMtf, MatchesCircularPupil) {
  const SceneFile scene = hyperbolic_scene();
  const optics::Assembly lens(scene.lens);
  const FieldMtfMeter meter(scene, false, true);
  const double limit = 2 * kSine / kWavelength_mm;
  double largest = 0;
  for (double s = 0.02; s < 1.2; s += 0.07) {
    const FieldMtf found = meter.measure(lens, nominal_pose(), s * limit);
    EXPECT_NEAR(found.centre, circular_pupil_mtf(s), 0.005) << s;
    EXPECT_NEAR(found.corner, circular_pupil_mtf(s), 0.01) << s;
    largest = std::max(largest, std::fabs(found.centre - circular_pupil_mtf(s)));
  }
  std::printf("largest deviation from the closed form: %.5f; limit %.1f lp/mm\n", largest, limit);
  EXPECT_EQ(meter.measure(lens, nominal_pose(), 1.5 * limit).centre, 0) << "nothing beyond the limit";
}

// A converging spherical wave, out of focus: the autocorrelation of exp(i k off sqrt(1 - r^2)) over the disc, by sums
// over a grid of its overlap.
double defocused_mtf(double off_mm, double lp_per_mm) {
  constexpr int kGrid = 1500;
  const double half_shear = lp_per_mm * kWavelength_mm / 2;
  const auto path = [&](double r2) { return off_mm * std::sqrt(1 - r2); };
  double light = 0, cosine = 0, sine = 0;
  for (int i = 0; i < kGrid; ++i)
    for (int j = 0; j < kGrid; ++j) {
      const double p = kSine * (2 * (i + 0.5) / kGrid - 1), q = kSine * (2 * (j + 0.5) / kGrid - 1);
      const double edge = kSine * kSine;
      if (p * p + q * q < edge) ++light;
      const double one = (p + half_shear) * (p + half_shear) + q * q;
      const double other = (p - half_shear) * (p - half_shear) + q * q;
      if (one >= edge || other >= edge) continue;
      const double phase = 2 * kPi / kWavelength_mm * (path(one) - path(other));
      cosine += std::cos(phase);
      sine += std::sin(phase);
    }
  return std::hypot(cosine, sine) / light;
}

TEST(DiffractionMtf, MatchesIntegralOfDefocusedPupil) {
  SceneFile scene = hyperbolic_scene();
  const optics::Assembly lens(scene.lens);
  double largest = 0;
  for (const double off_mm : {0.5, -1.375, 3.0}) {  // a fifth, a half and just over one wave at the rim
    scene.sensor.z_mm = 10 + kFocus_mm + off_mm;
    const FieldMtfMeter meter(scene, false, true);
    for (const double lp_per_mm : {5.0, 10.0, 20.0, 40.0, 60.0}) {
      const double expected = defocused_mtf(off_mm, lp_per_mm);
      const double found = meter.measure(lens, nominal_pose(), lp_per_mm).centre;
      EXPECT_NEAR(found, expected, 0.005) << off_mm << " mm, " << lp_per_mm << " lp/mm";
      largest = std::max(largest, std::fabs(found - expected));
    }
  }
  std::printf("largest deviation from the integral: %.5f\n", largest);
}

TEST(DiffractionMtf, ApproachesGeometricMtfForShortWaves) {
  SceneFile scene = relign_od_scene();
  scene.lens.wavelength_nm = 1;
  Random random(7);
  const optics::Assembly perfect(scene.lens), built = random_assembly(random);
  const FieldMtfMeter rays(scene, true), waves(scene, true, true);
  double largest = 0;
  for (const optics::Assembly* lens : {&perfect, &built})
    for (const std::vector<double>& pose : {nominal_pose(), {0.52, 0.47, 0.505, 0.6, 0.45}})
      for (const FieldPoint& point : field_points(scene))
        for (const double lp_per_mm : {5.0, 20.0, 40.0}) {
          const Modulation one = rays.modulation_at(point, *lens, pose, lp_per_mm);
          const Modulation other = waves.modulation_at(point, *lens, pose, lp_per_mm);
          EXPECT_NEAR(other.tangential, one.tangential, 0.01) << lp_per_mm;
          EXPECT_NEAR(other.sagittal, one.sagittal, 0.01) << lp_per_mm;
          largest = std::max(
              {largest, std::fabs(other.tangential - one.tangential), std::fabs(other.sagittal - one.sagittal)});
        }
  std::printf("largest deviation from rays at a wavelength of 1 nm: %.5f\n", largest);
}

TEST(DiffractionMtf, DependsOnlyOnArgumentsAndIsZeroWithoutLight) {
  SceneFile scene = relign_od_scene();
  const optics::Assembly lens(scene.lens);
  const FieldMtfMeter one(scene, true, true), other(scene, true, true);
  const FieldMtf first = one.measure(lens, nominal_pose(), 20);
  one.measure(lens, {0.51, 0.5, 0.5, 0.55, 0.5}, 40);
  EXPECT_EQ(first.centre, one.measure(lens, nominal_pose(), 20).centre);
  EXPECT_EQ(first.corner, other.measure(lens, nominal_pose(), 20).corner);
  EXPECT_NE(first.centre, FieldMtfMeter(scene, true).measure(lens, nominal_pose(), 20).centre);
  scene.lens.stops.push_back({"lid", scene.lens.elements.front().faces.front().z_mm - 0.1, 1e-6, false, false});
  const FieldMtf dark = FieldMtfMeter(scene, true, true).measure(optics::Assembly(scene.lens), nominal_pose(), 20);
  EXPECT_EQ(dark.centre, 0);
  EXPECT_EQ(dark.corner, 0);
}

TEST(DiffractionMtf, ApproachesGeometricMtfOnShippedScenes) {
  for (const std::string& name : shipped_scenes()) {
    SceneFile scene = read_scene_file(scene_folder() + name + "/scene.json", {});
    const double lp_per_mm = 0.125 / scene.sensor.pitch_mm;
    const optics::Assembly lens(scene.lens);
    const FieldMtf rays = FieldMtfMeter(scene, true).measure(lens, nominal_pose(), lp_per_mm);
    const FieldMtf waves = FieldMtfMeter(scene, true, true).measure(lens, nominal_pose(), lp_per_mm);
    std::printf("%-20s %6.2f lp/mm: centre %.3f (rays %.3f), corner %.3f (rays %.3f)\n", name.c_str(), lp_per_mm,
                waves.centre, rays.centre, waves.corner, rays.corner);
    EXPECT_GT(waves.centre, 0.25) << name;
    EXPECT_GT(waves.corner, 0.02) << name;
    EXPECT_LE(waves.centre, 1) << name;
    scene.lens.wavelength_nm = 0.1;
    const FieldMtf short_waves = FieldMtfMeter(scene, true, true).measure(lens, nominal_pose(), lp_per_mm);
    EXPECT_NEAR(short_waves.centre, rays.centre, 0.01) << name;
    // Of uncorrected lenses two rays from one point may leave in one direction close to the rim, which has one place in
    // the pupil function: 2 % of the light at the corners of relign_l3.
    const bool folds = name == "relign_l2" || name == "relign_l3";
    EXPECT_NEAR(short_waves.corner, rays.corner, folds ? 0.03 : 0.01) << name;
  }
}

}  // namespace
}  // namespace relign::imaging::diffraction_mtf
