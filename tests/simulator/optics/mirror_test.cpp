// Mirrors on the axis against closed forms of conics: a paraboloid, concentric spheres, two mirrors.
#include <gmock/gmock.h>

#include <cmath>

#include "error_text.h"
#include "optics/first_order.h"
#include "optics/prescription.h"
#include "optics/trace.h"

namespace relign::optics {
namespace {

using testing::HasSubstr;

Prescription lens_of(const std::string& elements, const std::string& image_z, const std::string& stop) {
  return read_prescription(JsonSource::from_text(R"({"format": 1, "name": "m", "image_z_mm": )" + image_z +
                                                     R"(, "half_field_deg": 0.5, "elements": [)" + elements +
                                                     R"(], "stops": [{"name": "s", "aperture": true, )" + stop + "}]}",
                                                 "lens.json"));
}
std::string refusal(const std::string& elements, const std::string& image_z, const std::string& stop) {
  return test::error_text(ErrorKind::bad_input, [&] { lens_of(elements, image_z, stop); });
}

const std::string kParaboloid =
    R"({"name": "M1", "faces": [{"z_mm": 0, "radius_mm": -200, "conic": -1, "mirror": true, "clear_radius_mm": 60}]})";
const std::string kStop = R"("z_mm": 0, "opening_radius_mm": 50, "on_face": 1)";

// Every ray parallel to the axis of a paraboloid passes its focus, on paths of equal length.
TEST(Mirror, ParaboloidFocusesPerfectly) {
  const Prescription lens = lens_of(kParaboloid, "-100", kStop);
  const FirstOrder data = first_order(lens);
  EXPECT_DOUBLE_EQ(data.focal_length, 100);
  EXPECT_DOUBLE_EQ(data.back_focal_length, -100);
  EXPECT_DOUBLE_EQ(data.f_number, 1);
  EXPECT_DOUBLE_EQ(data.exit_pupil_from_last, 0);
  EXPECT_DOUBLE_EQ(data.exit_pupil_diameter, 100);
  for (const double height : {1.0, 20.0, 49.0}) {
    const TracedRay ray = trace(Assembly(lens), {{0, height, -300}, {0, 0, 1}}, Apertures::mesh);
    ASSERT_TRUE(ray.passed) << ray.lost_at;
    EXPECT_NEAR(ray.image.y, 0, 1e-12);
    EXPECT_NEAR(ray.optical_path_mm, 400, 1e-11);
    EXPECT_EQ(ray.transmittance, 1);
    EXPECT_LT(ray.exit_direction.z, 0);
  }
  EXPECT_EQ(trace(Assembly(lens), {{0, 51, -300}, {0, 0, 1}}, Apertures::mesh).lost_at,
            "M1: outside the opening of its stop");
}

// The image of a far point is at f tan(field) before a paraboloid's own focal plane, up to coma.
TEST(Mirror, ChiefRayAndDistortionMatchClosedForm) {
  const Prescription lens = lens_of(kParaboloid, "-100", kStop);
  const TracedRay ray = trace(Assembly(lens), chief_ray(lens, 0.5), Apertures::none);
  ASSERT_TRUE(ray.passed);
  EXPECT_NEAR(ray.image.y, 100 * std::tan(0.5 / 57.29577951308232), 1e-10);
  EXPECT_NEAR(distortion(lens, 0.5), 0, 1e-10);
}

// All faces of a Mangin mirror are concentric: a ray through the centre returns on itself, whatever the glass.
TEST(Mirror, ManginMirrorIsPassedTwice) {
  const std::string mangin = R"({"name": "L1", "faces": [
      {"z_mm": 0, "radius_mm": -100, "index_after": 1.6, "clear_radius_mm": 50},
      {"z_mm": 10, "radius_mm": -110, "mirror": true, "clear_radius_mm": 55},
      {"z_mm": 0, "radius_mm": -100, "clear_radius_mm": 50}]})";
  const Prescription lens = lens_of(mangin, "-100", R"("z_mm": 0, "opening_radius_mm": 40, "on_face": 1)");
  const TracedRay ray = trace(Assembly(lens), {{0, 0, -100}, {0, 0.3, 1}}, Apertures::none);
  ASSERT_TRUE(ray.passed) << ray.lost_at;
  EXPECT_NEAR(ray.image.y, 0, 1e-12);
  EXPECT_NEAR(ray.exit_direction.y / ray.exit_direction.z, 0.3, 1e-12);
  EXPECT_NEAR(ray.optical_path_mm, 2 * (100 + 1.6 * 10), 1e-10);
  EXPECT_DOUBLE_EQ(lens.elements[0].faces[1].index_after, -1.6);
  // Two faces at normal incidence, each twice: (1 - R)^2 with R = ((1.6 - 1) / 2.6)^2.
  EXPECT_NEAR(ray.transmittance, std::pow(1 - std::pow(0.6 / 2.6, 2), 2), 1e-12);
}

// 1 / f = 1 / f1 + 1 / f2 - d / (f1 f2), and the focus is f (f1 - d) / f1 behind the second mirror.
TEST(Mirror, TwoMirrorsFollowTheGaussianFormula) {
  const std::string two = R"({"name": "M1", "faces": [{"z_mm": 0, "radius_mm": -21335.137, "conic": -1.0961,
      "mirror": true, "clear_radius_mm": 2000}]}, {"name": "M2", "faces": [{"z_mm": -7490.46, "radius_mm": -9576.712,
      "conic": -5.1628, "mirror": true, "clear_radius_mm": 800}]})";
  const Prescription lens = lens_of(two, "1951.373", R"("z_mm": 0, "opening_radius_mm": 1981.2, "on_face": 1)");
  const double f1 = 21335.137 / 2, f2 = -9576.712 / 2, d = 7490.46, f = 1 / (1 / f1 + 1 / f2 - d / (f1 * f2));
  const FirstOrder data = first_order(lens);
  EXPECT_NEAR(data.focal_length, f, 1e-8 * f);
  EXPECT_NEAR(data.back_focal_length, f * (f1 - d) / f1, 1e-8 * f);
  // A Ritchey-Chretien telescope is sharp, and obeys the sine condition: y / sin u' is f for every height.
  for (const double height : {800.0, 1400.0, 1980.0}) {
    const TracedRay ray = trace(Assembly(lens), {{0, height, -9000}, {0, 0, 1}}, Apertures::none);
    ASSERT_TRUE(ray.passed) << ray.lost_at;
    EXPECT_NEAR(-height / ray.exit_direction.y, f, 2e-4 * f);
  }
}

TEST(Mirror, RejectsInvalidMirrors) {
  EXPECT_THAT(refusal(kParaboloid, "100", kStop), HasSubstr("the image plane is in front of the last face"));
  EXPECT_THAT(refusal(kParaboloid, "-100", R"("z_mm": -10, "opening_radius_mm": 50)"),
              HasSubstr("give 'before_face' or 'on_face'"));
  std::string glass = kParaboloid;
  glass.replace(glass.find("\"mirror\": true"), 14, R"("mirror": true, "index_after": 1.5)");
  EXPECT_THAT(refusal(glass, "-100", kStop), HasSubstr("a mirror has no medium behind it"));
  std::string lens = kParaboloid;
  lens.replace(lens.find("\"mirror\": true"), 14, "\"mirror\": false");
  EXPECT_THAT(refusal(lens, "-100", kStop), HasSubstr("expected at least two faces, found 1"));
}

}  // namespace
}  // namespace relign::optics
