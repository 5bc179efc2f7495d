// Reading of lens files, and every mistake with its position.
#include "optics/prescription.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/files.h"
#include "lens_under_test.h"
#include "optics/assembly.h"
#include "optics/first_order.h"
#include "optics/trace.h"

namespace relign::optics {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string complaint(const std::string& from, const std::string& to) {
  std::string text = read_file(std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system/relign_od/lens.json");
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  try {
    read_prescription(JsonSource::from_text(text, "lens.json"));
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.what();
  }
  return "accepted";
}

TEST(Prescription, ReadsThePapersLens) {
  const Prescription& lens = relign_od();
  ASSERT_EQ(lens.elements.size(), 4u);
  EXPECT_EQ(lens.elements[2].name, "L3");
  EXPECT_DOUBLE_EQ(1 / lens.elements[1].faces[0].curvature, -65.83880);
  EXPECT_EQ(lens.elements[1].faces[1].index_after, 1);
  EXPECT_EQ(lens.aperture_stop().opening_radius_mm, 1.367413);
  ASSERT_TRUE(lens.barrel.has_value());
  EXPECT_EQ(lens.barrel->bore_radius_mm, 4.91);
}

TEST(Prescription, ReportsEveryMistakeWithPosition) {
  EXPECT_THAT(complaint("\"index_after\": 1.487439", "\"index_after\": 0.9"),
              HasSubstr("lens.json:12:58: /elements/0/faces/0/index_after: expected a number from 1 to 5, found 0.9"));
  EXPECT_THAT(complaint("\"index_after\": 1.487439, ", ""), HasSubstr("missing key 'index_after'"));
  EXPECT_THAT(complaint("\"radius_mm\": 2.95545", "\"radius_mm\": 2.8"), HasSubstr("exceeds the sphere's radius 2.8"));
  EXPECT_THAT(complaint("\"radius_mm\": 2.95545", "\"radius_mm\": 0"), HasSubstr("write null for a plane"));
  EXPECT_THAT(complaint("\"z_mm\": 12.577042", "\"z_mm\": 10.6"), HasSubstr("must come after the previous one"));
  EXPECT_THAT(complaint("\"z_mm\": 12.877042", "\"z_mm\": 12.6"), HasSubstr("accepted"));
  EXPECT_THAT(complaint("\"radius_mm\": 8.08098", "\"radius_mm\": -3.5"),
              HasSubstr("the face crosses the previous one"));
  EXPECT_THAT(complaint("\"z_mm\": 10.363930", "\"z_mm\": 11"), HasSubstr("is inside the glass of L2: its plane is"));
  EXPECT_THAT(complaint(", \"aperture\": true", ""), HasSubstr("exactly one stop must have"));
  EXPECT_THAT(complaint("\"opening_radius_mm\": 2.77", "\"opening_radius_mm\": 5"),
              HasSubstr("larger than the bore of the barrel"));
  EXPECT_THAT(complaint("\"name\": \"L2\"", "\"name\": \"L1\""), HasSubstr("duplicate name 'L1'"));
  EXPECT_THAT(complaint("\"stops\"", "\"stop\""), HasSubstr("unknown key 'stop'; did you mean 'stops'?"));
  EXPECT_THAT(complaint("\"format\": 1", "\"format\": 2"), HasSubstr("/format: found 2; allowed: 1"));
  EXPECT_THAT(complaint("\"image_z_mm\": 20.587550", "\"image_z_mm\": 17"), HasSubstr("is in front of the last face"));
  EXPECT_THAT(complaint("\"elements\": [", "\"elements\": [], \"x\": ["),
              HasSubstr("/elements: expected a list of at least 1 object"));
}

// One face of the paper's lens with other keys.
Prescription with_keys(const std::string& from, const std::string& to) {
  std::string text = read_file(std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system/relign_od/lens.json");
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  return read_prescription(JsonSource::from_text(text, "lens.json"));
}

TEST(Prescription, ReadsConicsAndAspheres) {
  const Face face = with_keys("\"radius_mm\": 2.95545,",
                              R"("radius_mm": 2.95545, "conic": -0.5, "even_asphere": [1e-3, 0, 2e-5, 0],)")
                        .elements[0]
                        .faces[1];
  EXPECT_EQ(face.conic, -0.5);
  EXPECT_EQ(face.even_asphere, (std::vector<double>{1e-3, 0, 2e-5})) << "trailing zeros are dropped";
  EXPECT_FALSE(face.is_sphere());
  EXPECT_THAT(complaint("\"radius_mm\": 2.95545,", R"("radius_mm": 2.95545, "conic": 0.5,)"),
              HasSubstr("exceeds the largest radius of the conic 2.413"));
  const std::string sixteen = R"("even_asphere": [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16],)";
  EXPECT_THAT(complaint("\"radius_mm\": 2.95545,", "\"radius_mm\": 2.95545, " + sixteen),
              HasSubstr("/elements/0/faces/1/even_asphere: expected a list of 1 to 15 numbers"));
  EXPECT_THAT(complaint("\"radius_mm\": 2.95545,", R"("radius_mm": 2.95545, "even_asphere": [0.01],)"),
              HasSubstr("accepted"));
  EXPECT_THAT(complaint("\"radius_mm\": 2.95545,", R"("radius_mm": 2.95545, "even_asphere": [-0.5],)"),
              HasSubstr("the face crosses the previous one"));
}

TEST(Prescription, ReadsOddAndForbesTerms) {
  const std::string radius = "\"radius_mm\": 2.95545,";
  const auto face = [&](const std::string& keys) { return with_keys(radius, radius + keys).elements[0].faces[1]; };
  const Face odd = face(R"("r2": 1e-3, "odd_asphere": [1e-4, -2e-5],)");
  EXPECT_EQ(odd.r2_term, 1e-3);
  EXPECT_EQ(odd.odd_asphere, (std::vector<double>{1e-4, -2e-5}));
  EXPECT_NEAR(odd.vertex_curvature(), 1 / 2.95545 + 2e-3, 1e-15);
  const Face strong = face(R"("q_con": {"radius_mm": 2, "coefficients": [0.016]},)");
  ASSERT_EQ(strong.even_asphere.size(), 1u);
  EXPECT_NEAR(strong.even_asphere[0], 1e-3, 1e-18);
  const Face mild = face(R"("q_bfs": {"radius_mm": 2, "coefficients": [0.004]},)");
  ASSERT_EQ(mild.over_root.size(), 2u);
  EXPECT_NEAR(mild.over_root[0], 1e-3, 1e-18);
  EXPECT_NEAR(mild.over_root[1], -2.5e-4, 1e-18);
  EXPECT_THAT(complaint(radius, radius + R"("r2": 0.01, "q_bfs": {"radius_mm": 2, "coefficients": [0.004]},)"),
              HasSubstr("the base of 'q_bfs' must be a sphere or a conic"));
  const Face on_conic = face(R"("conic": -0.5, "q_bfs": {"radius_mm": 2, "coefficients": [0.004]},)");
  EXPECT_NEAR(on_conic.over_root[0], 1e-3, 1e-5);
  // The normal of this ellipsoid's rim leaves the axis by 90 degrees where k c^2 r^2 is 1.
  EXPECT_THAT(complaint(radius, radius + R"("conic": 3, "q_bfs": {"radius_mm": 2, "coefficients": [0.004]},)"),
              HasSubstr("terms up to r^32 cannot represent these 'q_bfs' coefficients on a conic of 3"));
  EXPECT_THAT(complaint(radius, radius + R"("q_con": {"coefficients": "many"},)"),
              AllOf(HasSubstr("radius_mm"), HasSubstr("expected a list of 1 to 14 numbers")));
}

// The order of a stop follows from its position or is stated: inside glass, and as the edge of a curved face.
TEST(Prescription, PlacesStopsAnywhereInSurfaceOrder) {
  const auto lens = [](const std::string& stop) {
    return read_prescription(JsonSource::from_text(R"({"format": 1, "name": "doublet", "image_z_mm": 60,
      "elements": [{"name": "L1", "faces": [{"z_mm": 0, "radius_mm": 30, "index_after": 1.5, "clear_radius_mm": 9},
                                            {"z_mm": 5, "radius_mm": -40, "index_after": 1.7, "clear_radius_mm": 9},
                                            {"z_mm": 8, "radius_mm": -90, "clear_radius_mm": 9}]}],
      "stops": [{"name": "stop", "opening_radius_mm": 6, "aperture": true, )" +
                                                       stop + "}]}",
                                                   "doublet.json"));
  };
  const Prescription inside = lens(R"("z_mm": 4, "before_face": 2)");
  EXPECT_EQ(inside.faces_before(inside.stops[0]), 1u);
  const Prescription edge = lens(R"("z_mm": 0, "on_face": 1)");
  EXPECT_TRUE(edge.stops[0].on_face);
  EXPECT_EQ(edge.faces_before(edge.stops[0]), 0u);
  // A ray 6.2 mm off the axis on the convex front is outside its edge; on the vertex's plane it would be 5.9 mm off.
  const double slope = -0.45;
  const double at_edge = 6.2, sag = 30 - std::sqrt(900 - at_edge * at_edge);
  const Ray ray{{0, at_edge - slope * (sag + 1), -1}, {0, slope, 1}};
  EXPECT_LT(at_edge - slope * sag, 6.6);
  EXPECT_THAT(trace(Assembly(edge), ray, Apertures::mesh).lost_at, HasSubstr("outside the opening of its stop"));
  EXPECT_TRUE(trace(Assembly(edge), {{0, 5.9, -1}, {0, 0, 1}}, Apertures::mesh).passed);
  // Inside glass the refracted ray applies: a ray at 6.3 mm in front is at 6.0 mm at the stop.
  const auto height = [&](double y) {
    const TracedRay traced = trace(Assembly(inside), {{0, y, -1}, {0, 0, 1}}, Apertures::none);
    return traced.hits[0].y +
           (4 - traced.hits[0].z) * (traced.hits[1].y - traced.hits[0].y) / (traced.hits[1].z - traced.hits[0].z);
  };
  for (const double y : {5.5, 6.1, 6.2, 6.25, 6.4})
    EXPECT_EQ(trace(Assembly(inside), {{0, y, -1}, {0, 0, 1}}, Apertures::mesh).passed, height(y) <= 6) << y;
  EXPECT_LT(height(6.1), 6);
  EXPECT_GT(height(6.4), 6);
  EXPECT_NEAR(first_order(inside).entrance_pupil_diameter, 12 * 0.01 / height(0.01), 1e-4);
  const auto refused = [&](const std::string& stop) -> std::string {
    try {
      lens(stop);
      return "accepted";
    } catch (const Error& error) {
      return error.what();
    }
  };
  EXPECT_THAT(refused(R"("z_mm": 4)"), HasSubstr("set its place in the surface order with 'before_face'"));
  EXPECT_THAT(refused(R"("z_mm": 4, "before_face": 5)"), HasSubstr("1 to 4"));
  EXPECT_THAT(refused(R"("z_mm": 0.1, "on_face": 1)"), HasSubstr("expected the z of that vertex, 0 mm, found 0.1"));
  EXPECT_THAT(refused(R"("z_mm": 0, "on_face": 1, "before_face": 1)"), HasSubstr("give either"));
}

TEST(Prescription, ReadsGlassesByName) {
  const std::string index = "\"index_after\": 1.487439,";
  const auto index_of = [&](const std::string& keys) {
    return with_keys(index, keys).elements[0].faces[0].index_after;
  };
  EXPECT_NEAR(index_of(R"("glass_after": "N-BK7",)"), 1.5167, 1e-4);
  EXPECT_NEAR(index_of(R"("glass_after": "487490.704058",)"), 1.487439, 1e-6);
  const auto own = with_keys("\"elements\": [", R"("glasses": {"A/B~C": {"nd": 1.5, "vd": 60}}, "elements": [)");
  EXPECT_EQ(own.elements.size(), 4u) << "an unused glass is not a mistake";
  EXPECT_THAT(complaint(index, R"("glass_after": "N-BK8",)"),
              HasSubstr("/elements/0/faces/0/glass_after: unknown glass 'N-BK8'; did you mean 'N-BK7'?"));
  EXPECT_THAT(complaint(index, index + R"("glass_after": "N-BK7",)"),
              HasSubstr("give either 'index_after' or 'glass_after'"));
  EXPECT_THAT(complaint("\"radius_mm\": 2.95545,", R"("radius_mm": 2.95545, "glass_after": "N-BK7",)"),
              HasSubstr("the last face must not have 'index_after' or 'glass_after'"));
}

TEST(Prescription, FileGlassesOverrideBuiltIn) {
  std::string text = read_file(std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system/relign_od/lens.json");
  const auto replace = [&](const std::string& from, const std::string& to) {
    ASSERT_NE(text.find(from), std::string::npos);
    text.replace(text.find(from), from.size(), to);
  };
  replace("\"index_after\": 1.487439,", R"("glass_after": "N-BK7",)");
  const std::string without = text;
  replace("\"elements\": [", R"("glasses": {"N-BK7": {"agf_formula": 1, "coefficients": [2.25]}}, "elements": [)");
  EXPECT_DOUBLE_EQ(read_prescription(JsonSource::from_text(text, "l")).elements[0].faces[0].index_after, 1.5);
  // Mistakes in a glass are reported once, at the glass.
  replace("\"coefficients\": [2.25]", "\"coefficients\": []");
  try {
    read_prescription(JsonSource::from_text(text, "lens.json"));
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("/glasses/N-BK7/coefficients: expected a list of at least 1 number"));
    EXPECT_THAT(error.what(), testing::Not(HasSubstr("unknown glass")));
  }
  text = without;
  replace("\"wavelength_nm\": 589,", "");
  try {
    read_prescription(JsonSource::from_text(text, "lens.json"));
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("missing key 'wavelength_nm'"));
  }
}

TEST(Prescription, PlacesElementsOffTheAxis) {
  const Prescription lens =
      with_keys("\"name\": \"L2\",", R"("name": "L2", "placement": {"tilt_deg": [2, 0], "shift_mm": [0, 0.1, 0]},)");
  // About the element's own front vertex, 10.66393 mm behind the first.
  const Vec3 vertex = lens.elements[1].placement.point({0, 0, 10.663930});
  EXPECT_NEAR(vertex.x, 0, 1e-14);
  EXPECT_NEAR(vertex.y, 0.1, 1e-14);
  EXPECT_NEAR(vertex.z, 10.663930, 1e-14);
  const Vec3 behind = lens.elements[1].placement.point({0, 0, 11.663930});
  EXPECT_NEAR(behind.y, 0.1 - std::sin(2 * 3.14159265358979 / 180), 1e-14);
  // An assembly's offset is applied after it: about the lens's pivot, z = 0.
  const Vec3 moved = Assembly(lens, {{"L2", {{0, 0, 0}, {0, 1}}}}).placement(1).point({0, 0, 10.663930});
  EXPECT_NEAR(moved.x, 10.663930 * std::sin(3.14159265358979 / 180), 1e-12);
  EXPECT_NEAR(moved.y, 0.1, 1e-14);
  EXPECT_THAT(complaint("\"name\": \"L2\",", R"("name": "L2", "placement": {"tilt_deg": [100, 0], "pivot": 1},)"),
              testing::AllOf(HasSubstr("/elements/1/placement/tilt_deg/0: expected a number from -90 to 90"),
                             HasSubstr("unknown key 'pivot'")));
}

}  // namespace
}  // namespace relign::optics
