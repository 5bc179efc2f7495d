// Completion of designs by ray tracing, first-order values of imported lenses, and mistakes with lines of the design.
#include "lens_files/completion.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "base/json_source.h"
#include "error_text.h"
#include "golden_lens.h"
#include "lens_files/axial_rays.h"
#include "optics/first_order.h"

namespace relign::lens_files::completion {
namespace {

using test::error_text;
using testing::HasSubstr;

CompleteLens complete(LensDesign& design) { return complete_lens(design, draft_lens(design, {}, "a", 0)); }
CompleteLens complete(const std::string& zmx) {
  LensDesign design = read_zmx(zmx, "a.zmx");
  return complete(design);
}
std::string refusal(const std::string& zmx) {
  return error_text(ErrorKind::bad_input, [&] { complete(zmx); });
}

TEST(Completion, MatchesEveryPrintedDigitOfThePapersLens) {
  LensDesign design = golden_design("relign_od.lis");
  const CompleteLens lens = complete(design);
  const optics::FirstOrder data = optics::first_order(lens.lens);
  const double half = 0.5e-4;  // of the last digit in the file
  EXPECT_NEAR(data.focal_length, design.published.at("focal_length"), half);
  EXPECT_NEAR(data.back_focal_length, design.published.at("back_focal_length"), half);
  EXPECT_NEAR(data.image_distance, design.published.at("image_distance"), half);
  EXPECT_NEAR(data.entrance_pupil_diameter, design.published.at("entrance_pupil_diameter"), half);
  EXPECT_NEAR(data.entrance_pupil_z, design.published.at("entrance_pupil_z"), half);
  EXPECT_NEAR(data.exit_pupil_diameter, design.published.at("exit_pupil_diameter"), half);
  EXPECT_NEAR(data.exit_pupil_from_last, design.published.at("exit_pupil_from_last"), half);
  EXPECT_EQ(lens.lens.half_field_deg, 42.05);
}

// Cooke triplet at 550 nm: what two design programs agree on (optiland issue 710).
void expect_cooke_triplet(LensDesign design) {
  GlassSources sources;
  sources.catalogues.push_back({"cooke.agf", read_agf(golden_bytes("cooke.agf"), "cooke.agf")});
  const CompleteLens lens = complete_lens(design, draft_lens(design, sources, "cooke", 0));
  const optics::FirstOrder data = optics::first_order(lens.lens);
  // The last digit of one of them is rounded the other way.
  const double half = 0.6e-6;
  EXPECT_NEAR(data.focal_length, 49.999783, half);
  EXPECT_NEAR(data.entrance_pupil_z, 11.512159, half);
  EXPECT_NEAR(data.exit_pupil_diameter, 10.233730, half);
  EXPECT_NEAR(data.exit_pupil_z - lens.lens.image_z_mm, -50.961348, half);
}

TEST(Completion, ReadsCookeTripletFromEveryFormat) {
  expect_cooke_triplet(golden_design("cooke_triplet_utf16.zmx"));
  expect_cooke_triplet(golden_design("cooke_triplet_utf8.zmx"));
  expect_cooke_triplet(golden_design("cooke_triplet.seq"));
  // nd and Vd alone give the dispersion less accurately: a few parts in 1e5 at 550 nm.
  LensDesign model = golden_design("cooke_triplet_latin1.zmx");
  EXPECT_NEAR(optics::first_order(complete(model).lens).focal_length, 49.9998, 0.01);
}

TEST(Completion, AspheresReadBackAndBendRays) {
  const optics::Prescription lens = complete(small_zmx("  TYPE EVENASPH\n  CONI -0.5\n  PARM 2 1e-6\n")).lens;
  const optics::Prescription sphere = complete(small_zmx()).lens;
  EXPECT_EQ(optics::first_order(lens).focal_length, optics::first_order(sphere).focal_length);
  EXPECT_GT(std::fabs(best_focus_z(lens, 0) - best_focus_z(sphere, 0)), 0.01);
}

TEST(Completion, RoundTrips) {
  LensDesign design = golden_design("relign_od.lis");
  const CompleteLens lens = complete(design);
  const optics::Prescription again = optics::read_prescription(JsonSource::from_text(pretty(lens.json), "lens.json"));
  EXPECT_EQ(optics::first_order(again).focal_length, optics::first_order(lens.lens).focal_length);
  EXPECT_EQ(again.elements[2].faces[1].curvature, 1 / 27.67499);
}

TEST(Completion, OpensStopBySystemAperture) {
  const std::string no_diameter = replaced(small_zmx(), "  DIAM 5\n", "");
  // Behind the lens the stop is narrower than the entrance pupil of 10 mm.
  const double opening = complete(no_diameter).lens.aperture_stop().opening_radius_mm;
  const optics::Prescription lens = complete(no_diameter).lens;
  EXPECT_LT(opening, 5);
  EXPECT_NEAR(optics::first_order(lens).entrance_pupil_diameter, 10, 1e-6);
  const optics::Prescription fast = complete(replaced(no_diameter, "ENPD 10", "FNUM 4 0")).lens;
  EXPECT_NEAR(optics::first_order(fast).f_number, 4, 1e-6);
  EXPECT_THAT(refusal(replaced(no_diameter, "ENPD 10\n", "")),
              HasSubstr("a.zmx:18: the file states neither the opening of the stop"));
}

// Apertures stated in lens files, and the resulting opening of the stop.
double opened_f_number(optics::Prescription lens) {
  lens.entrance_pupil_diameter_mm = 0;
  return optics::first_order(lens).f_number;
}

TEST(Completion, StatedApertureOverridesStopSurface) {
  for (const std::string own : {"DIAM 5\n", "DIAM 4.5\n", "DIAM 2\n", ""}) {
    LensDesign design = read_zmx(replaced(small_zmx(), "  DIAM 5\n", own.empty() ? "" : "  " + own), "a.zmx");
    const optics::Prescription lens = complete(design).lens;
    EXPECT_NEAR(optics::first_order(lens).entrance_pupil_diameter, 10, 1e-6) << own;
    EXPECT_NEAR(opened_f_number(lens), optics::first_order(lens).f_number, 1e-6) << own;
  }
  // A ray at height 1 is at 0.9536 by the stop: 5 mm against 4.768 mm.
  LensDesign design = read_zmx(small_zmx(), "a.zmx");
  const CompleteLens lens = complete(design);
  EXPECT_THAT(lens.opening_reason, HasSubstr("from ENPD 10 mm (line 3), not 5.00000 mm of the stop surface"));
  EXPECT_THAT(design.remarks.back().text,
              HasSubstr("not used: the semi-diameter of the stop, surface 3, 5.000 mm (f/4.83), wider than ENPD 10 mm "
                        "(line 3) requires, which opens the stop to 4.768 mm (f/5.07)"));
  EXPECT_EQ(design.remarks.back().line, 19);
  LensDesign narrow = read_zmx(replaced(small_zmx(), "DIAM 5\n", "DIAM 2\n"), "a.zmx");
  complete(narrow);
  EXPECT_THAT(narrow.remarks.back().text, HasSubstr("2.000 mm (f/12.1), narrower than ENPD 10 mm (line 3) requires"));
  LensDesign fits = read_zmx(replaced(small_zmx(), "DIAM 5\n", "DIAM 4.75\n"), "a.zmx");
  complete(fits);
  EXPECT_TRUE(fits.remarks.empty());
}

TEST(Completion, StopSurfaceAppliesIfSelectedOrNoApertureIsStated) {
  for (const std::string aperture : {"FLOA\n", ""}) {
    LensDesign design = read_zmx(replaced(small_zmx(), "ENPD 10\n", aperture), "a.zmx");
    const CompleteLens lens = complete(design);
    EXPECT_EQ(lens.lens.aperture_stop().opening_radius_mm, 5);
    EXPECT_FALSE(lens.json.contains("entrance_pupil_diameter_mm"));
    EXPECT_TRUE(design.remarks.empty());
    EXPECT_THAT(lens.opening_reason,
                HasSubstr(aperture.empty() ? "states no system aperture" : "FLOA selects it (line 3)"));
  }
}

TEST(Completion, OpensFaceThatIsTheStop) {
  std::string text = replaced(small_zmx(), "  STOP\n", "");
  text = replaced(replaced(text, "SURF 2\n", "SURF 2\n  STOP\n"), "  DISZ 1\n  DIAM 12\n", "  DISZ 1\n  DIAM 3\n");
  LensDesign design = read_zmx(text, "a.zmx");
  const optics::Prescription lens = complete(design).lens;
  EXPECT_GT(lens.aperture_stop().opening_radius_mm, 4);
  EXPECT_TRUE(lens.aperture_stop().on_face);
  EXPECT_EQ(lens.elements[0].faces[1].clear_radius_mm, lens.aperture_stop().opening_radius_mm);
  // As wide as the file's pupil needs: the marginal ray hits the edge, whatever the face's curvature.
  const auto lost_at = [&](double height) {
    return optics::trace(optics::Assembly(lens), {{0, height, -1}, {0, 0, 1}}, optics::Apertures::mesh).lost_at;
  };
  EXPECT_EQ(lost_at(4.9999), "");
  EXPECT_THAT(lost_at(5.0001), HasSubstr("L1 back: outside"));
  ASSERT_EQ(design.remarks.size(), 1U);
  EXPECT_THAT(design.remarks[0].text, HasSubstr("surface 2, 3.000 mm"));
}

TEST(Completion, RemarksOnSemiDiametersThatBlockTheAxialBeam) {
  // The axial beam fills 5 mm of the first face, all but; a face that is the stop itself never stops it.
  LensDesign narrow = read_zmx(replaced(small_zmx(), "DIAM 12\n", "DIAM 4.5\n"), "a.zmx");
  complete(narrow);
  ASSERT_EQ(narrow.remarks.size(), 2U);
  EXPECT_EQ(narrow.remarks[1].line, 10);
  EXPECT_THAT(narrow.remarks[1].text,
              HasSubstr("the semi-diameter of surface 1, 4.500 mm, blocks light on the axis: the beam through the "
                        "stop needs 5.000 mm"));
  EXPECT_THAT(narrow.remarks[1].text, HasSubstr("so that f/5.07 is not reached"));
  LensDesign wide = read_zmx(replaced(small_zmx(), "DIAM 12\n", "DIAM 5\n"), "a.zmx");
  complete(wide);
  EXPECT_EQ(wide.remarks.size(), 1U);
  std::string on_face = replaced(replaced(small_zmx(), "  STOP\n", ""), "SURF 2\n", "SURF 2\n  STOP\n");
  on_face = replaced(replaced(on_face, "  DISZ 1\n  DIAM 12\n", "  DISZ 1\n  DIAM 4\n"), "ENPD 10", "FLOA");
  LensDesign floating = read_zmx(on_face, "a.zmx");
  EXPECT_EQ(complete(floating).lens.elements[0].faces[1].clear_radius_mm, 4);
  EXPECT_TRUE(floating.remarks.empty());
}

TEST(Completion, RemarksOnPlanePlatesInFrontOfTheImage) {
  const std::string plate =
      "SURF 4\n  DISZ 1\n  GLAS ___BLANK 1 0 1.5 0\n  DIAM 9\nSURF 5\n  DISZ 0.5\n  DIAM 9\nSURF 6\n  DISZ 0\n";
  LensDesign design = read_zmx(replaced(small_zmx(), "SURF 4\n  DISZ 0\n", plate), "a.zmx");
  const CompleteLens lens = complete(design);
  ASSERT_EQ(lens.lens.elements.size(), 2U);
  ASSERT_EQ(design.remarks.size(), 2U);
  EXPECT_EQ(design.remarks[1].line, 23);
  EXPECT_THAT(design.remarks[1].text,
              HasSubstr("surfaces 4-5 (L2) are a plane plate in front of the image: it moves with"));
}

// The stop's plane cuts the convex first face, its rim is in air: at radius r the glass begins r^2 / 100 behind the
// vertex.
std::string stop_in_front(const std::string& distance, const std::string& aperture, const std::string& diameter) {
  return "UNIT MM\n" + aperture +
         "\nFTYP 0 0 1 1\nYFLN 5\nWAVM 1 0.55 1\nPWAV 1\nSURF 0\n  DISZ INFINITY\n"
         "SURF 1\n  STOP\n  DISZ " +
         distance + "\n" + diameter +
         "SURF 2\n  CURV 0.02\n  DISZ 4\n  GLAS ___BLANK 1 0 1.5 0\n  DIAM 12\n"
         "SURF 3\n  CURV -0.02\n  DISZ 48.6\n  DIAM 12\nSURF 4\n  DISZ 0\n";
}

TEST(Completion, StopMayBeBehindTheVertexOfAConvexFace) {
  for (const std::string aperture : {"ENPD 16", "FLOA"}) {
    LensDesign design = read_zmx(stop_in_front("-0.6", aperture, "  DIAM 8\n"), "a.zmx");
    const optics::Prescription lens = complete(design).lens;
    EXPECT_TRUE(design.remarks.empty()) << design.remarks[0].text;
    EXPECT_EQ(lens.aperture_stop().z_mm, 0.6);
    const optics::FirstOrder data = optics::first_order(lens);
    EXPECT_EQ(data.entrance_pupil_z, 0.6);
    EXPECT_NEAR(data.entrance_pupil_diameter, 16, 1e-9);
    // The plane on which rays are judged is the stop's: 8 mm from the axis there, by the line on which they came.
    for (const double field : {0.0, 5.0})
      for (const FanRay& ray : beam(lens, field, 0)) EXPECT_LE(std::fabs(ray.stop_height_mm), 8.05);
    const double slope = std::tan(5 / 57.29577951308232);
    const auto passes = [&](double height) {
      return optics::trace(optics::Assembly(lens), {{0, height - 1.6 * slope, -1}, {0, slope, 1}},
                           optics::Apertures::mesh)
          .lost_at;
    };
    EXPECT_EQ(passes(7.999), "");
    EXPECT_EQ(passes(-7.999), "");
    EXPECT_EQ(passes(8.001), "aperture stop: outside the opening");
    EXPECT_EQ(passes(-8.001), "aperture stop: outside the opening");
  }
}

// As in design programs: light passes the stop in the order of the file, wherever its plane is.
TEST(Completion, StopMayBeAnywhereInSurfaceOrder) {
  const auto stop_of = [](const std::string& text) {
    LensDesign design = read_zmx(text, "a.zmx");
    return complete(design).lens.aperture_stop();
  };
  for (const char* distance : {"-0.6", "-2", "-60"}) {
    const optics::Stop stop = stop_of(stop_in_front(distance, "ENPD 10", "  DIAM 8\n"));
    EXPECT_EQ(stop.z_mm, -std::stod(distance));
    EXPECT_EQ(stop.before_face, 0u) << distance;
    EXPECT_EQ(stop.opening_radius_mm, 5) << "the stop is the entrance pupil";
  }
  const optics::Stop behind = stop_of(replaced(small_zmx(), "  DISZ 1\n", "  DISZ -0.2\n"));
  EXPECT_EQ(behind.before_face, 2u);
  EXPECT_FALSE(stop_of(small_zmx()).before_face) << "in air its position determines the order";
  // Within a doublet.
  const std::string inside =
      "UNIT MM\nENPD 10\nFTYP 0 0 1 1\nYFLN 5\nWAVM 1 0.55 1\nPWAV 1\nSURF 0\n  DISZ INFINITY\n"
      "SURF 1\n  CURV 0.02\n  DISZ 3\n  GLAS ___BLANK 1 0 1.5 0\n  DIAM 12\nSURF 2\n  STOP\n  DISZ 2\n"
      "  GLAS ___BLANK 1 0 1.5 0\nSURF 3\n  CURV -0.02\n  DISZ 48.6\n  DIAM 12\nSURF 4\n  DISZ 0\n";
  EXPECT_EQ(stop_of(inside).before_face, 1u);
  EXPECT_EQ(stop_of(inside).z_mm, 3);
}

TEST(Completion, TrimsSemiDiametersToWhereFacesCross) {
  // Both faces have a radius of 50 mm and are 2 mm apart: they cross 9.95 mm from the axis.
  LensDesign crossing = read_zmx(replaced(small_zmx(), "DISZ 4\n", "DISZ 2\n"), "a.zmx");
  const optics::Prescription lens = complete(crossing).lens;
  const double meet = std::sqrt(50 * 50 - 49 * 49);
  for (const optics::Face& face : lens.elements[0].faces) {
    EXPECT_LT(face.clear_radius_mm, meet);
    EXPECT_GT(face.clear_radius_mm, 0.998 * meet);
  }
  const auto remark = std::find_if(crossing.remarks.begin(), crossing.remarks.end(),
                                   [](const Remark& one) { return one.text.find("trimmed") != std::string::npos; });
  ASSERT_NE(remark, crossing.remarks.end());
  EXPECT_THAT(remark->text,
              HasSubstr("the semi-diameter of surface 1, 12.0000 mm, extends beyond where the next face crosses"));
  LensDesign wide = read_zmx(replaced(small_zmx(), "DIAM 12", "DIAM 60"), "a.zmx");
  EXPECT_LT(complete(wide).lens.elements[0].faces[0].clear_radius_mm, 50) << "of the sphere";
  // Faces that cross within the axial beam are rejected.
  std::string thin = replaced(replaced(small_zmx(), "DISZ 4\n", "DISZ 0.45\n"), "DIAM 12", "DIAM 8");
  EXPECT_THAT(refusal(replaced(thin, "ENPD 10", "ENPD 9.64")),
              HasSubstr("crosses its neighbour within the axial beam"));
}

TEST(Completion, RejectsInvalidApertures) {
  EXPECT_THAT(refusal(replaced(small_zmx(), "ENPD 10", "ENPD 0")),
              HasSubstr("a.zmx:3: ENPD: expected a system aperture above 0, found 0"));
  EXPECT_THAT(refusal(replaced(small_zmx(), "ENPD 10", "FNUM -5 0")),
              HasSubstr("a.zmx:3: FNUM: expected a system aperture above 0, found -5"));
  EXPECT_THAT(refusal(replaced(small_zmx(), "ENPD 10", "ENPD nan")), HasSubstr("a.zmx:3: ENPD: expected a number"));
  EXPECT_THAT(refusal(replaced(small_zmx(), "ENPD 10", "ENPD 1e9")),
              HasSubstr("a.zmx:3: ENPD 1e+09 mm gives an entrance pupil of"));
  EXPECT_THAT(refusal(replaced(small_zmx(), "ENPD 10", "OBNA 0.1")),
              HasSubstr("a.zmx:3: OBNA is an aperture at the object, but the object is at infinity"));
  EXPECT_THAT(refusal(replaced(small_zmx(), "ENPD 10", "ENPD 40")),
              HasSubstr("a.zmx:3: ENPD 40 mm opens the stop to a radius of 19.07"));
  EXPECT_THAT(error_text(ErrorKind::bad_input, [] { read_design(small_seq("", "FNO -2"), "a.seq"); }),
              HasSubstr("a.seq:7: FNO: expected a system aperture above 0, found -2"));
  // Of two the last counts, and the other is named.
  const LensDesign two = read_zmx(small_zmx("", "FNUM 4\n"), "a.zmx");
  EXPECT_EQ(two.aperture.kind, SystemAperture::f_number);
  ASSERT_EQ(two.remarks.size(), 1U);
  EXPECT_EQ(two.remarks[0].text, "not used: ENPD; line 8 states FNUM");
}

TEST(Completion, SemiDiametersTransmitTheWholeField) {
  std::string text = small_zmx();
  for (int i = 0; i < 2; ++i) text = replaced(text, "  DIAM 12\n", "");
  LensDesign design = read_zmx(text, "a.zmx");
  const optics::Prescription lens = complete(design).lens;
  ASSERT_FALSE(design.remarks.empty());
  EXPECT_THAT(design.remarks.back().text, HasSubstr("assumed: semi-diameters"));
  // The beam's radius at the stop plus its shift at 5 degrees, plus a small margin.
  const double front = lens.elements[0].faces[0].clear_radius_mm;
  EXPECT_GT(front, 5);
  EXPECT_LT(front, 7);
}

TEST(Completion, AssumesMissingImagePlaneAndField) {
  LensDesign design = read_zmx(replaced(replaced(small_zmx(), "DISZ 47.6", "DISZ -1"), "YFLN 5", "YFLN 0"), "a.zmx");
  const CompleteLens lens = complete(design);
  const optics::FirstOrder data = optics::first_order(lens.lens);
  EXPECT_NEAR(data.image_distance, data.back_focal_length, 1e-9);
  EXPECT_EQ(lens.lens.half_field_deg, 10);
  ASSERT_EQ(design.remarks.size(), 3U);  // and of the stop
  EXPECT_THAT(design.remarks[0].text, HasSubstr("paraxial focus"));
  EXPECT_THAT(design.remarks[1].text, HasSubstr("half field of 10 degrees"));
}

TEST(Completion, ReadsFieldsAsHeights) {
  const auto half_field = [](const std::string& zmx) { return complete(zmx).lens.half_field_deg; };
  const double focal = optics::first_order(complete(small_zmx()).lens).focal_length;
  EXPECT_NEAR(half_field(small_zmx("", "FTYP 2 0 1 1\n")), std::atan(5 / focal) * 57.29577951308232, 1e-6);
  EXPECT_THAT(refusal(small_zmx("", "FTYP 1 0 1 1\n")),
              HasSubstr("a.zmx:8: fields are object heights, but the object"));
  // 500 mm before the first vertex; the stop behind the lens is seen a few mm behind that.
  EXPECT_NEAR(half_field(replaced(small_zmx("", "FTYP 1 0 1 1\n"), "INFINITY", "500")), 0.568, 0.002);
}

TEST(Completion, ReportsMistakesWithLinesOfTheDesign) {
  EXPECT_THAT(refusal(replaced(small_zmx(), "DIAM 12", "DIAM 160")),
              HasSubstr("a.zmx:10: surface 1: the semi-diameter 160 mm exceeds the sphere's radius 50 mm"));
  EXPECT_THAT(refusal(replaced(small_zmx(), "DISZ 4\n", "DISZ 0.2\n")),
              HasSubstr("a.zmx:15: surface 2: the face crosses"));
  EXPECT_THAT(refusal(replaced(small_zmx(), "DISZ 4\n", "DISZ -4\n")),
              HasSubstr("a.zmx:15: surface 2: the face at z = -4"));
  EXPECT_THAT(refusal(replaced(small_zmx(), "DISZ 47.6", "DISZ 2e6")),
              HasSubstr("a.zmx:23: surface 4: expected a number from -1e+06 to 1e+06, found 2000005.0"));
  EXPECT_THAT(refusal(replaced(replaced(small_zmx(), "DIAM 5\n", "DIAM 13\n"), "ENPD 10", "FLOA")),
              HasSubstr("a.zmx:19: the stop opens to a radius of 13.0000 mm, wider than every face"));
}

TEST(AxialRays, BestFocusOfAThinBeamIsTheParaxialImage) {
  LensDesign design =
      read_zmx(replaced(replaced(small_zmx(), "ENPD 10", "ENPD 0.02"), "DIAM 5\n", "DIAM 0.01\n"), "a.zmx");
  const optics::Prescription lens = complete(design).lens;
  const optics::FirstOrder data = optics::first_order(lens);
  EXPECT_NEAR(best_focus_z(lens, 0), data.overall_length + data.back_focal_length, 1e-4);
  // Newton: z z' = f^2, counted from the focal points.
  const double before = 1000 + data.front_focal_length, behind = data.focal_length * data.focal_length / before;
  EXPECT_NEAR(best_focus_z(lens, 1000), data.overall_length + data.back_focal_length + behind, 1e-4);
  EXPECT_NEAR(image_height(lens, 1, 0, data.overall_length + data.back_focal_length),
              data.focal_length * std::tan(1 / 57.29577951308232), 0.005);
}

TEST(AxialRays, SphericalAberrationPullsTheFocusIn) {
  const optics::Prescription lens = complete(small_zmx()).lens;
  const optics::FirstOrder data = optics::first_order(lens);
  EXPECT_LT(best_focus_z(lens, 0), data.overall_length + data.back_focal_length - 0.05);
}

TEST(Pretty, ReadsBackAndKeepsQuotes) {
  const OrderedJson json = {{"a", {1, 2.5, nullptr}},
                            {"b\"", "x, y: \"z\" \\"},
                            {"c", OrderedJson::object()},
                            {"d", {{{"e", 1}, {"f", {1, 2}}}}}};
  EXPECT_EQ(OrderedJson::parse(pretty(json)), json);
  EXPECT_THAT(pretty(json), HasSubstr("\"a\": [1, 2.5, null],\n"));
}

// Semi-diameter of the first face, far before the stop: found by the importer.
double found_radius(const std::string& vignetting, const std::string& field = "10") {
  const std::string text =
      "UNIT MM\nENPD 10\nFTYP 0 0 1 1\nYFLN " + field + "\nWAVM 1 0.55 1\nPWAV 1\n" + vignetting +
      "SURF 0\n  DISZ INFINITY\nSURF 1\n  DISZ 2\n  GLAS ___BLANK 1 0 1.5 0\nSURF 2\n  DISZ 40\nSURF 3\n  STOP\n"
      "  CURV 0.01\n  DISZ 2\n  GLAS ___BLANK 1 0 1.5 0\nSURF 4\n  DISZ 195\nSURF 5\n";
  LensDesign design = read_zmx(text, "a.zmx");
  return complete_lens(design, draft_lens(design, {}, "a", 0)).lens.elements[0].faces[0].clear_radius_mm;
}

TEST(Completion, FindsSemiDiametersOfVignettedBeams) {
  const double full = found_radius("");
  // The beam goes upwards: its lower edge is the far one 40 mm before the stop.
  EXPECT_NEAR(full - found_radius("VCYN 0.5\n"), 1.03 * 2.5, 0.05);
  EXPECT_NEAR(full - found_radius("VCYN 0.25\nVDYN 0.25\n"), 1.03 * 2.5, 0.05);
  EXPECT_NEAR(found_radius("VCYN 0.25\nVDYN -0.25\n"), full, 0.05);
  // The same seen upside down.
  EXPECT_NEAR(full - found_radius("VCYN 0.25\nVDYN -0.25\n", "-10"), 1.03 * 2.5, 0.05);
}

TEST(Completion, RealImageHeightsAreThoseOfTheChiefRay) {
  const auto half_field = [](const std::string& type) {
    return complete(replaced(replaced(small_zmx(), "FTYP 0", "FTYP " + type), "YFLN 5", "YFLN 15")).lens.half_field_deg;
  };
  const double paraxial = half_field("2"), real = half_field("3");
  EXPECT_GT(std::fabs(paraxial - real), 1e-3);
  const optics::Prescription lens = complete(small_zmx()).lens;
  EXPECT_NEAR(image_height(lens, real, 0, lens.image_z_mm), 15, 1e-4);
  // No chief ray reaches that height: the paraxial field with a remark, reduced to where light passes.
  LensDesign far = read_zmx(replaced(replaced(small_zmx(), "FTYP 0", "FTYP 3"), "YFLN 5", "YFLN 400"), "a.zmx");
  EXPECT_LT(complete(far).lens.half_field_deg, 82.9);
  EXPECT_THAT(far.remarks.back().text, HasSubstr("reduced to the largest at which one does"));
  EXPECT_THAT(far.remarks[0].text, HasSubstr("no chief ray reaches the real image height of 400.0 mm"));
}

}  // namespace
}  // namespace relign::lens_files::completion
