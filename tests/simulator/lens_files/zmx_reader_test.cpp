// Zemax files: every keyword that is read, what is listed as not understood, every refusal with its line.
#include "lens_files/zmx_reader.h"

#include <gmock/gmock.h>

#include "error_text.h"
#include "golden_lens.h"

namespace relign::lens_files {
namespace {

using test::error_text;
using testing::ElementsAre;
using testing::HasSubstr;

LensDesign read(const std::string& text) { return read_zmx(text, "a.zmx"); }
std::string refusal(const std::string& text) {
  return error_text(ErrorKind::bad_input, [&] { read(text); });
}

TEST(ZmxReader, ReadsTheCookeTriplet) {
  const LensDesign lens = golden_design("cooke_triplet_utf16.zmx");
  EXPECT_EQ(lens.title, "Cooke triplet, 50 mm f/5 (\u03b2)");
  ASSERT_EQ(lens.surfaces.size(), 8U);
  EXPECT_EQ(lens.surfaces[0].thickness_mm, kInfinite);
  EXPECT_DOUBLE_EQ(1 / lens.surfaces[1].curvature, 22.01359);
  EXPECT_DOUBLE_EQ(lens.surfaces[6].thickness_mm, 42.20778);
  EXPECT_EQ(lens.surfaces[3].glass, "F2");
  EXPECT_EQ(lens.surfaces[3].nd, 0);  // the catalogue name alone counts: 1.5 and 40 are fillers
  EXPECT_EQ(lens.surfaces[2].glass, "");
  EXPECT_TRUE(lens.surfaces[4].stop);
  EXPECT_EQ(lens.surfaces[4].clear_radius_mm, 5);
  EXPECT_EQ(lens.aperture.kind, SystemAperture::entrance_pupil_diameter);
  EXPECT_EQ(lens.aperture.value, 10);
  EXPECT_EQ(lens.field.kind, FieldSize::angle_deg);
  EXPECT_EQ(lens.field.value, 20);
  EXPECT_EQ(lens.wavelength_nm, 550);
  ASSERT_EQ(lens.remarks.size(), 1U);  // merit function and tolerances behind the surfaces
  EXPECT_THAT(lens.remarks[0].text, HasSubstr("merit function"));
}

TEST(ZmxReader, ReadsEncodingsAndDecimalCommas) {
  const LensDesign utf8 = golden_design("cooke_triplet_utf8.zmx"), latin = golden_design("cooke_triplet_latin1.zmx");
  EXPECT_EQ(utf8.surfaces[1].glass, "SK16");
  EXPECT_EQ(latin.title, "Cooke-Triplett f\u00fcr \u00dcbungen");
  EXPECT_EQ(latin.surfaces[1].glass, "");  // a model glass
  EXPECT_EQ(latin.surfaces[1].nd, 1.62041);
  EXPECT_EQ(latin.surfaces[1].vd, 60.32);
  EXPECT_EQ(latin.surfaces[1].clear_radius_mm, 0);
}

TEST(ZmxReader, ReadsConicsAndEvenAspheres) {
  const LensDesign lens = read(small_zmx("  TYPE EVENASPH\n  CONI -0.5\n  PARM 1 0\n  PARM 2 1e-5\n  PARM 4 -2E-9\n"));
  EXPECT_EQ(lens.surfaces[1].conic, -0.5);
  EXPECT_THAT(lens.surfaces[1].even_asphere, ElementsAre(0, 1e-5, 0, -2e-9));
}

TEST(ZmxReader, ReadsCoordinateBreaks) {
  const std::string text =
      "WAVM 1 0.55 1\nSURF 0\n DISZ INFINITY\nSURF 1\n TYPE COORDBRK\n PARM 1 0.1\n PARM 2 -0.2\n PARM 3 1\n PARM 4 2\n"
      " DISZ 0\nSURF 2\n TYPE COORDBRK\n PARM 1 -0.1\n PARM 2 0.2\n PARM 3 -1\n PARM 4 -2\n PARM 6 1\n DISZ 0\n";
  const LensDesign lens = read(text);
  ASSERT_TRUE(lens.surfaces[1].before && lens.surfaces[2].before);
  EXPECT_TRUE(lens.surfaces[1].break_only);
  EXPECT_EQ(lens.surfaces[1].before->translation.x, 0.1);
  // Right-handed: a positive turn about x sends z towards -y.
  EXPECT_LT(lens.surfaces[1].before->rotation[5], 0);
  // Order 1 with opposite numbers undoes order 0.
  const optics::Motion both = after(*lens.surfaces[1].before, *lens.surfaces[2].before);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(both.rotation[i], optics::kIdentityRotation[i], 1e-15);
  EXPECT_NEAR(both.translation.y, 0, 1e-15);
}

TEST(ZmxReader, UnitsScaleEveryLength) {
  std::string text = replaced(small_zmx("  TYPE EVENASPH\n  PARM 2 1\n"), "UNIT MM", "UNIT IN");
  const LensDesign lens = read(text);
  EXPECT_DOUBLE_EQ(1 / lens.surfaces[1].curvature, 50 * 25.4);
  EXPECT_DOUBLE_EQ(lens.surfaces[1].thickness_mm, 4 * 25.4);
  EXPECT_DOUBLE_EQ(lens.surfaces[1].clear_radius_mm, 12 * 25.4);
  EXPECT_DOUBLE_EQ(lens.surfaces[1].even_asphere[1], 1 / (25.4 * 25.4 * 25.4));
  EXPECT_DOUBLE_EQ(lens.aperture.value, 254);
  EXPECT_EQ(lens.field.value, 5);  // degrees
  EXPECT_EQ(lens.surfaces[0].thickness_mm, kInfinite);
}

TEST(ZmxReader, ReadsSystemWords) {
  const auto field = [](const std::string& system) { return read(small_zmx("", system)).field; };
  EXPECT_EQ(field("FTYP 1 0 1 1\n").kind, FieldSize::object_height_mm);
  EXPECT_EQ(field("FTYP 2 0 1 1\n").kind, FieldSize::image_height_mm);
  EXPECT_EQ(field("FTYP 3 0 1 1\n").kind, FieldSize::real_image_height_mm);
  EXPECT_EQ(field("FTYP 0 0 2 1\nXFLN 0 3\nYFLN 0 4 99\n").value, 5);  // the third is not used
  EXPECT_EQ(read(small_zmx("", "FNUM 2.8 0\n")).aperture.kind, SystemAperture::f_number);
  EXPECT_EQ(read(small_zmx("", "OBNA 0.1 0\n")).aperture.kind, SystemAperture::object_na);
  EXPECT_EQ(read(small_zmx("", "FLOA\n")).aperture.kind, SystemAperture::stop_size);
  EXPECT_EQ(read(small_zmx("", "WAVL 0.48 0.6\nPWAV 2\n")).wavelength_nm, 600);
  EXPECT_EQ(read(small_zmx("  CLAP 0 7 0\n  DIAM 6\n")).surfaces[1].clear_radius_mm, 7);
}

TEST(ZmxReader, ReadsVignettingOfFields) {
  const LensDesign lens = read(small_zmx("", "FTYP 0 0 2 1\nYFLN 0 20\nVDYN 0 -0.167\nVCYN 0 0.4315\nVCXN 0 0.1\n"));
  ASSERT_EQ(lens.fields.size(), 2U);
  // The upper edge of the beam is at VDY + 1 - VCY, the lower one at VDY - 1 + VCY.
  EXPECT_DOUBLE_EQ(lens.fields[1].cut_above, 0.5985);
  EXPECT_DOUBLE_EQ(lens.fields[1].cut_below, 0.2645);
  EXPECT_EQ(lens.fields[1].cut_left, 0.1);
  // Words that begin alike are not vignetting factors.
  EXPECT_NO_THROW(read(small_zmx("", "VDSZ 0 -1e10 1e10\nVCON name\n")));
}

TEST(ZmxReader, SelectsConfiguration) {
  const std::string rest = " 0 0 0 1 1 1 0 0 \"\" 0\n";
  const std::string text = small_zmx() + "MNUM 3 1\nLTTL 0 1 \"far\" 0\nLTTL 0 2 \"near\" 0\nTHIC 0 1 1e10" + rest +
                           "THIC 0 2 300" + rest + "THIC 2 1 1" + rest + "THIC 2 2 2.5" + rest + "CRVT 1 1 0.02" +
                           rest + "CRVT 1 2 0.03" + rest + "CONN 1 2 -0.5" + rest + "APER 0 1 10" + rest +
                           "APER 0 2 8" + rest + "YFIE 1 2 4" + rest + "PRAM 1 1 0" + rest + "PRAM 1 2 0" + rest +
                           "PRAM 1 3 1" + rest;
  const LensDesign near = read_zmx_with_problems(text, "a.zmx", 2);
  EXPECT_TRUE(near.problems.empty());
  EXPECT_EQ(near.surfaces[0].thickness_mm, 300);
  EXPECT_EQ(near.surfaces[2].thickness_mm, 2.5);
  EXPECT_EQ(near.surfaces[1].curvature, 0.03);
  EXPECT_EQ(near.surfaces[1].conic, -0.5);
  EXPECT_EQ(near.aperture.value, 8);
  EXPECT_EQ(near.field.value, 4);
  const LensDesign stands = read(text);
  EXPECT_EQ(stands.surfaces[2].thickness_mm, 1);
  EXPECT_THAT(stands.remarks[0].text, HasSubstr("in the current one, configuration 1 of 3 (--configuration selects"));
  const LensDesign third = read_zmx_with_problems(text, "a.zmx", 3);
  ASSERT_EQ(third.problems.size(), 1U);
  EXPECT_THAT(third.problems[0].message, HasSubstr("operand PRAM 1 differs between configuration 3 and 1"));
  EXPECT_THAT(read_zmx_with_problems(text, "a.zmx", 4).problems[0].message, HasSubstr("unknown configuration 4"));
}

TEST(ZmxReader, RemarksOnUnknownWords) {
  const LensDesign lens = read(small_zmx("  XDAT 1 5\n  XDAT 2 6\n", "VCYN 0 0.3 0.1\nBLAH 1 2\n"));
  ASSERT_EQ(lens.remarks.size(), 3U);
  EXPECT_EQ(lens.remarks[0].text, kVignettingRemark);
  EXPECT_EQ(lens.remarks[1].text, "not understood: BLAH 1 2");
  EXPECT_EQ(lens.remarks[1].line, 9);
  EXPECT_EQ(lens.remarks[2].text, "not understood: XDAT 1 5 of surface 1, type STANDARD");
  EXPECT_EQ(lens.remarks[2].more_lines, 1);
}

TEST(ZmxReader, RemarksOnAssumedUnit) {
  std::string text = replaced(small_zmx(), "UNIT MM\n", "");
  const LensDesign lens = read(text);
  ASSERT_EQ(lens.remarks.size(), 1U);
  EXPECT_EQ(lens.remarks[0].text, "assumed: lengths in mm; the file has no UNIT");
}

TEST(ZmxReader, RejectsWithFileAndLine) {
  EXPECT_THAT(refusal(small_zmx("", "WAVM 1 550 1\n")),
              HasSubstr("a.zmx:8: WAVM, WAVL: expected micrometres from 0.1 to 100 (green: 0.55), found 550"));
  EXPECT_THAT(refusal("MODE NSC\n" + small_zmx()), HasSubstr("a.zmx:1: unsupported mode 'NSC'; only sequential"));
  EXPECT_THAT(refusal("hello\n"), HasSubstr("a.zmx: no surfaces (SURF) found"));
  EXPECT_THAT(refusal(small_zmx("  TYPE TOROIDAL\n")),
              HasSubstr("a.zmx:15: surface 1 has unsupported type 'TOROIDAL'; supported are"));
  EXPECT_THAT(refusal(small_zmx("  CURV x1\n")), HasSubstr("a.zmx:15: CURV: expected a number, found 'x1'"));
  EXPECT_THAT(refusal(small_zmx("  GLAS ___BLANK 1 0 0.9 50\n")),
              HasSubstr("expected a model glass of index 1 or more, found 0.9"));
  EXPECT_THAT(refusal(small_zmx("SURF 7\n")), HasSubstr("expected surface 2, found '7'"));
  EXPECT_THAT(refusal(small_zmx("", "UNIT FURLONG\n")),
              HasSubstr("a.zmx:8: UNIT: unknown unit 'FURLONG'; allowed are"));
  EXPECT_THAT(refusal(small_zmx("", "PWAV 3\n")), HasSubstr("a.zmx:8: PWAV: the primary wavelength is number 3"));
  EXPECT_THAT(refusal("SURF 0\n"), HasSubstr("a.zmx: no wavelength (WAVM) found"));
  EXPECT_THAT(refusal(small_zmx("  TYPE COORDBRK\n  PARM 3 1e9\n")),
              HasSubstr("expected a tilt from -360 to 360 degrees"));
}

TEST(ZmxReader, LimitsNumberAndLengthOfProblems) {
  std::string many = "WAVM 1 0.5 1\n", wrong = small_zmx();
  for (std::size_t i = 0; i <= kMaxSurfaces; ++i) many += "SURF " + std::to_string(i) + "\n";
  EXPECT_THAT(refusal(many), HasSubstr("a.zmx:1002: more than 1000 surfaces"));
  for (int i = 0; i < 50; ++i) wrong += "  CURV x\n";
  EXPECT_THAT(refusal(wrong), HasSubstr("and 30 more mistakes"));
}

}  // namespace
}  // namespace relign::lens_files
