// From surfaces to elements: glasses, positions, stops, coordinate breaks; every refusal with the file's line.
#include "lens_files/lens_writer.h"

#include <gmock/gmock.h>

#include "error_text.h"
#include "golden_lens.h"
#include "lens_files/seq_reader.h"
#include "optics/assembly.h"

namespace relign::lens_files::lens_writer {
namespace {

using test::error_text;
using testing::HasSubstr;

GlassSources cooke_glasses() {
  GlassSources sources;
  sources.catalogues.push_back({"cooke.agf", read_agf(golden_bytes("cooke.agf"), "cooke.agf")});
  return sources;
}
OrderedJson lens_of(const std::string& zmx, const GlassSources& sources = {}) {
  LensDesign design = read_zmx(zmx, "a.zmx");
  return lens_json(draft_lens(design, sources, "a", 0), design);
}
std::string refusal(const std::string& zmx) {
  return error_text(ErrorKind::bad_input, [&] { lens_of(zmx); });
}
TEST(LensWriter, GroupsSurfacesIntoElements) {
  LensDesign design = golden_design("cooke_triplet_utf16.zmx");
  const OrderedJson lens = lens_json(draft_lens(design, cooke_glasses(), "cooke", 0), design);
  ASSERT_EQ(lens["elements"].size(), 3U);
  EXPECT_EQ(lens["elements"][1]["name"], "L2");
  EXPECT_EQ(lens["elements"][0]["faces"][0]["radius_mm"], 22.01359);
  EXPECT_EQ(lens["elements"][0]["faces"][0]["glass_after"], "SK16");
  EXPECT_FALSE(lens["elements"][0]["faces"][1].contains("glass_after"));
  EXPECT_EQ(lens["elements"][2]["faces"][1]["z_mm"], 17.96897);
  EXPECT_EQ(lens["stops"][0]["z_mm"], 10.26648);
  EXPECT_EQ(lens["image_z_mm"], 60.17675);
  // Every glass once, with its formula and all of its coefficients.
  EXPECT_EQ(lens["glasses"].size(), 2U);
  EXPECT_EQ(lens["glasses"]["F2"]["agf_formula"], 2);
  EXPECT_EQ(lens["glasses"]["F2"]["coefficients"].size(), 6U);
}

TEST(LensWriter, NeverReplacesGlasses) {
  LensDesign design = golden_design("cooke_triplet_utf16.zmx");
  const std::string text = error_text(ErrorKind::bad_input, [&] { draft_lens(design, {}, "cooke", 0); });
  EXPECT_THAT(text, HasSubstr("cooke_triplet_utf16.zmx:42: surface 1: unknown glass 'SK16'"));
  EXPECT_THAT(text, HasSubstr("unknown glass 'F2'"));
  EXPECT_THAT(text, HasSubstr("--glass FILE.agf"));
  // Known by name only: the file states nothing else.
  GlassSources built_in;
  built_in.is_known = [](const std::string& name) { return name == "SK16" || name == "F2"; };
  EXPECT_FALSE(lens_json(draft_lens(design, built_in, "cooke", 0), design).contains("glasses"));
}

TEST(LensWriter, RemarksOnOtherSpellings) {
  LensDesign design = read_seq(small_seq("GLA NBK7_SCHOTT"), "a.seq");
  GlassSources built_in;
  built_in.is_known = [](const std::string& name) { return name == "N-BK7"; };
  EXPECT_EQ(draft_lens(design, built_in, "a", 0).elements[0].faces[0].behind.name, "N-BK7");
  ASSERT_EQ(design.remarks.size(), 1U);
  EXPECT_EQ(design.remarks[0].text, "glass NBK7_SCHOTT is read as N-BK7");
}

TEST(LensWriter, WritesModelGlassesAndIndices) {
  EXPECT_EQ(lens_of(small_zmx())["elements"][0]["faces"][0]["index_after"], 1.5);  // no dispersion: Vd 0
  const OrderedJson model = lens_of(small_zmx("  GLAS ___BLANK 1 0 1.62041 60.32\n"));
  EXPECT_EQ(model["elements"][0]["faces"][0]["glass_after"], "nd1.62041-Vd60.32");
  EXPECT_EQ(model["glasses"]["nd1.62041-Vd60.32"]["vd"], 60.32);
  // A listing's indices hold for its own wavelength; for another one the code must be known.
  LensDesign design = golden_design("relign_od.lis");
  EXPECT_EQ(draft_lens(design, {}, "od", 0).elements[3].faces[0].behind.index, 1.555431);
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { draft_lens(design, {}, "od", 486); }),
              HasSubstr("unknown glass '487490.704058'"));
}

TEST(LensWriter, RemarksOnWavelengthsOutsideCatalogueRange) {
  LensDesign design = golden_design("cooke_triplet_utf8.zmx");
  const std::size_t before = design.remarks.size();
  draft_lens(design, cooke_glasses(), "cooke", 3000);
  EXPECT_EQ(design.remarks.size(), before + 4);  // and the file's wavelengths
  EXPECT_THAT(design.remarks.back().text, HasSubstr("from 0.31 to 2.5 um, but the lens uses it at 3 um"));
}

TEST(LensWriter, RemarksOnUnusedWavelengths) {
  LensDesign design = golden_design("cooke_triplet_utf8.zmx");
  draft_lens(design, cooke_glasses(), "cooke", 0);
  EXPECT_EQ(design.remarks[1].text,
            "not used: the wavelengths 480, 650 nm; images use one, 550 nm, the file's reference (--wavelength selects "
            "another, scene new --polychromatic all of them)");
  LensDesign all = golden_design("cooke_triplet_utf8.zmx");
  draft_lens(all, cooke_glasses(), "cooke", 0, true);
  for (const Remark& remark : all.remarks) EXPECT_THAT(remark.text, testing::Not(HasSubstr("wavelength")));
  EXPECT_EQ(design.remarks[1].line, 20);
  LensDesign other = golden_design("cooke_triplet_utf8.zmx");
  draft_lens(other, cooke_glasses(), "cooke", 650);
  EXPECT_THAT(other.remarks[1].text,
              HasSubstr("the wavelengths 480, 550 nm; images use one, 650 nm, from --wavelength"));
  // FTYP: one wavelength is used; the others are what Zemax fills its list with.
  LensDesign filled = read_zmx(small_zmx("", "WAVM 2 0.65 1\nWAVM 3 0.55 1\n"), "a.zmx");
  draft_lens(filled, {}, "a", 0);
  EXPECT_TRUE(filled.remarks.empty());
  LensDesign three =
      read_zmx(replaced(small_zmx("", "WAVM 2 0.65 1\nWAVM 3 0.55 1\n"), "FTYP 0 0 1 1", "FTYP 0 0 1 3"), "a.zmx");
  draft_lens(three, {}, "a", 0);
  ASSERT_EQ(three.remarks.size(), 1U);
  EXPECT_THAT(three.remarks[0].text, HasSubstr("not used: the wavelength 650 nm;"));
}

TEST(LensWriter, WritesCementedElementsAndSkipsDummies) {
  const std::string doublet =
      "ENPD 10\nWAVM 1 0.55 1\nSURF 0\n DISZ INFINITY\nSURF 1\n DISZ 3\nSURF 2\n CURV 0.02\n DISZ 4\n GLAS A\n"
      "SURF 3\n CURV -0.02\n DISZ 2\n GLAS B\nSURF 4\n STOP\n DISZ 50\nSURF 5\n";
  GlassSources any;
  any.is_known = [](const std::string&) { return true; };
  const OrderedJson lens = lens_of(doublet, any);
  ASSERT_EQ(lens["elements"].size(), 1U);
  ASSERT_EQ(lens["elements"][0]["faces"].size(), 3U);
  EXPECT_EQ(lens["elements"][0]["faces"][0]["z_mm"], 0);  // the dummy in front of it is ignored
  EXPECT_EQ(lens["elements"][0]["faces"][1]["glass_after"], "B");
  EXPECT_EQ(lens["stops"][0]["z_mm"], 6);
}

TEST(LensWriter, ReportsAllProblemsAtOnce) {
  const std::string text = replaced(small_zmx("  TYPE TOROIDAL\n"), "___BLANK 1 0 1.5 0", "X 0 0 1.5 40");
  LensDesign design = read_design_with_problems(replaced(text, "  STOP\n", ""), "a.zmx");
  const std::string all = error_text(ErrorKind::bad_input, [&] { draft_lens(design, {}, "a", 0); });
  EXPECT_THAT(all, HasSubstr("a.zmx: exactly one surface must be the stop, found 0"));
  EXPECT_THAT(all, HasSubstr("a.zmx:13: surface 1: unknown glass 'X'"));
  EXPECT_THAT(all, HasSubstr("a.zmx:15: surface 1 has unsupported type 'TOROIDAL'"));
  EXPECT_LT(all.find("unknown glass"), all.find("TOROIDAL"));  // by line
}

std::string glass_zmx(const std::string& glass) { return replaced(small_zmx(), "___BLANK 1 0 1.5 0", glass); }

TEST(LensWriter, AppliesAliases) {
  GlassSources sources;
  sources.is_known = [](const std::string& name) { return name == "N-BK7"; };
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { lens_of(glass_zmx("BK7 0 0 1.5 40"), sources); }),
              HasSubstr("surface 1: unknown glass 'BK7'; give its catalogue with --glass FILE.agf, name an "
                        "equivalent glass with --alias BK7=NAME, or replace it by a code"));
  sources.aliases = {parse_alias("bk7=N-BK7")};
  LensDesign design = read_zmx(glass_zmx("BK7 0 0 1.5 40"), "a.zmx");
  EXPECT_EQ(draft_lens(design, sources, "a", 0).elements[0].faces[0].behind.name, "N-BK7");
  EXPECT_EQ(design.remarks.back().text, "glass BK7 is read as N-BK7 (--alias)");
  for (const char* wrong : {"BK7", "=N-BK7", "BK7= ", ""})
    EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { parse_alias(wrong); }), HasSubstr("expected NAME=NAME"));
}

TEST(LensWriter, GlassFromFileUsesStatedIndex) {
  GlassSources sources;
  const std::string text = glass_zmx("S-FPL55 0 0 1.43875 94.66");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { lens_of(text, sources); }),
              HasSubstr("or use nd 1.43875 and Vd 94.66 from the file with --glass-from-file"));
  sources.from_file = true;
  LensDesign design = read_zmx(text, "a.zmx");
  const OrderedJson lens = lens_json(draft_lens(design, sources, "a", 0), design);
  EXPECT_EQ(lens["elements"][0]["faces"][0]["glass_after"], "S-FPL55");
  EXPECT_EQ(lens["glasses"]["S-FPL55"], OrderedJson({{"nd", 1.43875}, {"vd", 94.66}}));
  EXPECT_THAT(design.remarks.back().text, HasSubstr("glass S-FPL55 has the index and Abbe number that the file"));
  // 1.5 and 40 are written by Zemax for unknown glasses.
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { lens_of(glass_zmx("X 0 0 1.5 40"), sources); }),
              HasSubstr("unknown glass 'X'"));
}

TEST(LensWriter, ModelGlassesKeepTheirNumbers) {
  for (const char* glass : {"APL5014CL_14_BLANK 1 0 1.544 56", "___BLANK 2 3 1.544 56", "APL5514_BLANK 2 3 1.544 56"}) {
    const OrderedJson lens = lens_of(glass_zmx(glass));
    EXPECT_EQ(lens["glasses"]["nd1.544-Vd56"], OrderedJson({{"nd", 1.544}, {"vd", 56.0}})) << glass;
  }
}

// A lens behind a coordinate break, followed by the inverse break.
std::string tilted(const std::string& there, const std::string& back) {
  return "ENPD 10\nWAVM 1 0.55 1\nSURF 0\n DISZ INFINITY\nSURF 1\n CURV 0.02\n DISZ 4\n GLAS A\nSURF 2\n DISZ 3\n"
         "SURF 3\n TYPE COORDBRK\n" +
         there +
         " DISZ 0\nSURF 4\n CURV 0.03\n DISZ 4\n GLAS A\nSURF 5\n CURV -0.03\n DISZ -4\n"
         "SURF 6\n TYPE COORDBRK\n" +
         back + " DISZ 4\nSURF 7\n STOP\n DISZ 50\nSURF 8\n";
}

TEST(LensWriter, CoordinateBreaksBecomePlacements) {
  GlassSources any;
  any.is_known = [](const std::string&) { return true; };
  const OrderedJson lens = lens_of(tilted(" PARM 1 0.2\n PARM 3 1.5\n PARM 4 -0.5\n PARM 5 30\n",
                                          " PARM 1 -0.2\n PARM 3 -1.5\n PARM 4 0.5\n PARM 5 -30\n PARM 6 1\n"),
                                   any);
  EXPECT_FALSE(lens["elements"][0].contains("placement"));
  const OrderedJson& placement = lens["elements"][1]["placement"];
  EXPECT_NEAR(placement["tilt_deg"][0].get<double>(), 1.5, 1e-9);
  EXPECT_NEAR(placement["tilt_deg"][1].get<double>(), -0.5, 1e-9);  // the rotation about its own axis has no effect
  EXPECT_EQ(placement["shift_mm"][0], 0.2);
  EXPECT_EQ(placement["shift_mm"][2], 0);
  EXPECT_EQ(lens["elements"][1]["faces"][0]["z_mm"], 7);
  EXPECT_EQ(lens["elements"][1]["faces"][1]["z_mm"], 11);
  EXPECT_EQ(lens["stops"][0]["z_mm"], 11);
}

TEST(LensWriter, RejectsUnbalancedCoordinateBreaks) {
  EXPECT_THAT(refusal(tilted(" PARM 3 1\n", " PARM 3 -0.9\n")), HasSubstr("leave the image tilted or off the axis"));
  EXPECT_THAT(refusal(tilted(" PARM 3 95\n", " PARM 3 -95\n")), HasSubstr("tilted by 90 degrees or more"));
  // Within an element: a wedge.
  LensDesign wedge = read_seq(replaced(small_seq(), "S -50 1", "S -50 1; ADE 1; DAR"), "a.seq");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { draft_lens(wedge, {}, "a", 0); }),
              HasSubstr("surface S2 is tilted or decentred relative to the front of its own element"));
  LensDesign stop = read_seq(replaced(small_seq(), "STO;", "STO; YDE 0.1; DAR;"), "a.seq");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { draft_lens(stop, {}, "a", 0); }),
              HasSubstr("the stop (surface S3) is tilted or off the axis"));
}

TEST(LensWriter, WritesAspheresAndR2Term) {
  const OrderedJson face =
      lens_of(small_zmx("  TYPE EVENASPH\n  CONI -0.5\n  PARM 2 1e-5\n  PARM 3 0\n  PARM 4 2e-9\n"
                        "  PARM 8 0\n"))["elements"][0]["faces"][0];
  EXPECT_EQ(face["conic"], -0.5);
  EXPECT_EQ(face["even_asphere"], OrderedJson({1e-5, 0, 2e-9}));
  // A paraboloid given by its term of r^2 alone.
  const OrderedJson parabola =
      lens_of(small_zmx("  TYPE EVENASPH\n  CURV 0\n  PARM 1 0.01\n"))["elements"][0]["faces"][0];
  EXPECT_EQ(parabola["radius_mm"], 50);
  EXPECT_EQ(parabola["conic"], -1);
  // With a curvature the term is kept, unless the face is a paraboloid.
  const OrderedJson beside = lens_of(small_zmx("  TYPE EVENASPH\n  PARM 1 0.01\n"))["elements"][0]["faces"][0];
  EXPECT_EQ(beside["radius_mm"], 50);
  EXPECT_EQ(beside["r2"], 0.01);
  EXPECT_FALSE(beside.contains("even_asphere"));
  const OrderedJson folded =
      lens_of(small_zmx("  TYPE EVENASPH\n  CONI -1\n  PARM 1 0.01\n"))["elements"][0]["faces"][0];
  EXPECT_EQ(folded["radius_mm"], 25);
  EXPECT_FALSE(folded.contains("r2"));
}

TEST(LensWriter, WritesOddAndQTypeTerms) {
  const OrderedJson odd =
      lens_of(small_zmx("  TYPE ODDASPHE\n  PARM 3 1e-4\n  PARM 4 2e-5\n  PARM 7 3e-8\n"
                        "  PARM 8 0\n"))["elements"][0]["faces"][0];
  EXPECT_EQ(odd["odd_asphere"], OrderedJson({1e-4, 0, 3e-8}));
  EXPECT_EQ(odd["even_asphere"], OrderedJson({2e-5}));
  const std::string q = "  TYPE QED_TYPE\n  XDAT 2 2\n  XDAT 3 12\n  XDAT 4 -0.5\n  XDAT 5 0.25\n";
  const OrderedJson face = lens_of(small_zmx(q))["elements"][0]["faces"][0];
  EXPECT_EQ(face["q_bfs"], OrderedJson({{"radius_mm", 12.0}, {"coefficients", {-0.5, 0.25}}}));
  EXPECT_EQ(lens_of(small_zmx(q + "  CONI -0.5\n"))["elements"][0]["faces"][0]["conic"], -0.5);
}

// As patents' files often end: the back of the cover glass takes the place of the image.
TEST(LensWriter, AddsMissingImageSurface) {
  std::string text = replaced(small_zmx(), "  DISZ 47.6", "  DISZ 20");
  text = replaced(text, "SURF 4\n  DISZ 0\n",
                  "SURF 4\n  DISZ 0.3\n  GLAS ___BLANK 1 0 1.5 0\n  DIAM 5\nSURF 5\n  DISZ 27\n  DIAM 5\n");
  LensDesign design = read_zmx(text, "a.zmx");
  const LensDraft draft = draft_lens(design, {}, "a", 0);
  EXPECT_TRUE(draft.image_stated);
  EXPECT_EQ(draft.image_z_mm, 4 + 1 + 20 + 0.3 + 27);
  ASSERT_EQ(draft.elements.size(), 2U);
  EXPECT_EQ(draft.elements[1].faces[1].z_mm, 25.3);
  ASSERT_FALSE(design.remarks.empty());
  EXPECT_EQ(design.remarks.back().text,
            "assumed: a missing image surface, 27.0000 mm behind surface 5; the file ends with glass in front of "
            "surface 5, which states a further distance");
  EXPECT_EQ(design.remarks.back().line, 27);
}

TEST(LensWriter, RejectsWithFileAndLine) {
  EXPECT_THAT(refusal(replaced(small_zmx(), "  STOP\n", "")),
              HasSubstr("exactly one surface must be the stop, found 0"));
  EXPECT_THAT(refusal(small_zmx("  STOP\n")), HasSubstr("found 2"));
  EXPECT_THAT(refusal(replaced(replaced(small_zmx(), "  STOP\n", ""), "SURF 4\n", "SURF 4\n  STOP\n")),
              HasSubstr("surface 4, the last one and therefore the image, is marked as the stop"));
  EXPECT_THAT(refusal(replaced(small_zmx(), "DISZ 4", "DISZ INFINITY")),
              HasSubstr("a.zmx:10: surface 1 is at infinite distance"));
  EXPECT_THAT(
      refusal(replaced(small_zmx(), "  DISZ 47.6", "  DISZ 47.6\n  GLAS X")),
      HasSubstr("a.zmx:19: the image is inside the glass behind surface 3, which extends to surface 4, the last one; "
                "if 4 is the back of a plate, add the image surface"));
  EXPECT_THAT(refusal(replaced(small_zmx(), "SURF 1", "  GLAS X\nSURF 1")), HasSubstr("the object is inside glass"));
  EXPECT_THAT(refusal(replaced(small_zmx(), "  GLAS ___BLANK 1 0 1.5 0\n", "")), HasSubstr("no lens found"));
  EXPECT_THAT(refusal("ENPD 10\nWAVM 1 0.55 1\nSURF 0\n DISZ INFINITY\n"),
              HasSubstr("a.zmx: found only 1 surface; a lens needs at least an object"));
  EXPECT_THAT(refusal(replaced(small_zmx(), "DIAM 12", "DIAM -12")), HasSubstr("negative semi-diameter"));
  EXPECT_THAT(refusal(replaced(small_zmx(), "0.55", "0.00055")),
              HasSubstr("a.zmx:6: WAVM, WAVL: expected micrometres from 0.1 to 100 (green: 0.55), found 0.00055"));
}

}  // namespace
}  // namespace relign::lens_files::lens_writer
