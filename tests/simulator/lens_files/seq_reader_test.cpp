// CODE V sequence files: every word that is read, what is listed, every refusal with its line.
#include "lens_files/seq_reader.h"

#include <gmock/gmock.h>

#include "error_text.h"
#include "golden_lens.h"

namespace relign::lens_files::seq_reader {
namespace {

using test::error_text;
using testing::ElementsAre;
using testing::HasSubstr;

LensDesign read(const std::string& text) { return read_seq(text, "a.seq"); }
std::string refusal(const std::string& text) {
  return error_text(ErrorKind::bad_input, [&] { read(text); });
}

TEST(SeqReader, ReadsTheCookeTriplet) {
  const LensDesign lens = golden_design("cooke_triplet.seq");
  EXPECT_EQ(lens.title, "Cooke triplet, 50 mm; f/5");  // a semicolon in quotes does not separate
  ASSERT_EQ(lens.surfaces.size(), 8U);
  EXPECT_EQ(lens.surfaces[0].thickness_mm, kInfinite);
  EXPECT_DOUBLE_EQ(1 / lens.surfaces[1].curvature, 22.01359);
  EXPECT_EQ(lens.surfaces[1].glass, "SK16_SCHOTT");
  EXPECT_EQ(lens.surfaces[1].clear_radius_mm, 9.5);
  EXPECT_TRUE(lens.surfaces[4].stop);
  EXPECT_EQ(lens.wavelength_nm, 550);  // the list of wavelengths continues on a second line
  EXPECT_EQ(lens.field.value, 20);
  ASSERT_EQ(lens.remarks.size(), 1U);
  EXPECT_EQ(lens.remarks[0].line, 15);
  EXPECT_EQ(lens.remarks[0].text, "not used: private glass 'MYSK16'; no surface uses it");
}

TEST(SeqReader, ReadsWordsAfterASurface) {
  const LensDesign lens = read(small_seq("ASP; K -0.5; A 1e-5; C 2e-9\nXDE 0.1; ADE 2; DAR\nTHI S0 1000; CUY S1 0.01"));
  const Surface& surface = lens.surfaces[1];
  EXPECT_EQ(surface.conic, -0.5);
  EXPECT_THAT(surface.even_asphere, ElementsAre(0, 1e-5, 0, 2e-9));
  EXPECT_EQ(surface.curvature, 0.01);
  EXPECT_EQ(lens.surfaces[0].thickness_mm, 1000);
  ASSERT_TRUE(surface.before && surface.after);
  EXPECT_EQ(surface.before->translation.x, 0.1);
  EXPECT_GT(surface.before->rotation[5], 0);  // left-handed: z goes towards +y
  const optics::Motion both = after(*surface.before, *surface.after);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(both.rotation[i], optics::kIdentityRotation[i], 1e-15);
  EXPECT_FALSE(lens.surfaces[2].before);
  // Without DAR the axis stays tilted.
  EXPECT_FALSE(read(small_seq("BDE 1")).surfaces[1].after);
}

TEST(SeqReader, ReadsCurvaturesUnitsAndAperture) {
  const LensDesign lens = read(small_seq("", "DIM I; RDM N; FNO 4; YIM 0.5"));
  EXPECT_DOUBLE_EQ(lens.surfaces[1].curvature, 50 / 25.4);
  EXPECT_DOUBLE_EQ(lens.surfaces[1].thickness_mm, 4 * 25.4);
  EXPECT_EQ(lens.aperture.kind, SystemAperture::f_number);
  EXPECT_EQ(lens.aperture.value, 4);
  EXPECT_EQ(lens.field.kind, FieldSize::image_height_mm);
  EXPECT_DOUBLE_EQ(lens.field.value, 12.7);
  EXPECT_EQ(read(small_seq("", "NAO 0.1")).aperture.kind, SystemAperture::object_na);
  EXPECT_EQ(read(small_seq("", "NA 0.1")).aperture.kind, SystemAperture::image_na);
  EXPECT_EQ(read(small_seq("", "YOB 3")).field.kind, FieldSize::object_height_mm);
}

TEST(SeqReader, ReadsCurvaturesWithoutRdm) {
  std::string text =
      replaced(replaced(replaced(small_seq(), "RDM; LEN", "LEN"), "S 50 4", "S 0.02 4"), "S -50 1", "S -0.02 1");
  const LensDesign lens = read(text);
  EXPECT_EQ(lens.surfaces[1].curvature, 0.02);
  ASSERT_EQ(lens.remarks.size(), 1U);
  EXPECT_EQ(lens.remarks[0].text,
            "assumed: surface values are curvatures, CODE V's default; the file has no RDM before them");
  text = replaced(text, "S 0.02 4", "S 50 4");
  EXPECT_THAT(refusal(text), HasSubstr("surface S1: a curvature of 50 is a sphere smaller than the beam"));
}

TEST(SeqReader, ReadsAspheresUpToR20) {
  const Surface surface = read(small_seq("ASP; A 1e-5; H 2e-19; J 3e-22")).surfaces[1];
  ASSERT_EQ(surface.even_asphere.size(), 10U);
  EXPECT_EQ(surface.even_asphere[8], 2e-19);
  EXPECT_EQ(surface.even_asphere[9], 3e-22);
}

TEST(SeqReader, ReadsOddPolynomials) {
  const Surface surface =
      read(small_seq("SPS ODD 2.0\n SCO K -0.5; SCC K 100\n SCO AR3 8e-3\n SCO C5 16e-4; SCO AR2 0.04")).surfaces[1];
  EXPECT_EQ(surface.conic, -0.5);
  EXPECT_THAT(surface.odd_asphere, ElementsAre(1e-3));
  EXPECT_THAT(surface.even_asphere, ElementsAre(0.01, 1e-4));
  EXPECT_EQ(read(small_seq("SPS ODD 0.0\n SCO AR5 1e-6")).surfaces[1].odd_asphere[1], 1e-6);
  EXPECT_THAT(refusal(small_seq("SPS ODD\n SCO AR1 0.1")), HasSubstr("a.seq:12: surface S1 has a term of r, 0.1"));
  EXPECT_THAT(refusal(small_seq("SPS XYP 10")), HasSubstr("a.seq:11: surface S1: unsupported 'SPS XYP'"));
}

TEST(SeqReader, SelectsZoomPosition) {
  const std::string text =
      small_seq() + "ZOO 3\nZOO TIT\nZOO THI S1 4 5 6\nTHI S3 Z2 40\nZOO EPD 10 8 6\nZOO YAN F1 5 5 9\nGO\n";
  const LensDesign second = read_seq_with_problems(text, "a.seq", 2);
  EXPECT_TRUE(second.problems.empty());
  EXPECT_EQ(second.surfaces[1].thickness_mm, 5);
  EXPECT_EQ(second.surfaces[3].thickness_mm, 40);
  EXPECT_EQ(second.aperture.value, 8);
  const LensDesign first = read(text);
  EXPECT_EQ(first.surfaces[1].thickness_mm, 4);
  EXPECT_EQ(first.surfaces[3].thickness_mm, 47.6);
  EXPECT_THAT(first.remarks[0].text, HasSubstr("read at position 1 of 3 (--configuration selects another)"));
  EXPECT_THAT(read_seq_with_problems(text, "a.seq", 3).problems[0].message, HasSubstr("ZOO YAN differs between zoom"));
  EXPECT_THAT(read_seq_with_problems(text, "a.seq", 4).problems.back().message, HasSubstr("unknown zoom position 4"));
}

TEST(SeqReader, ReadsModelGlasses) {
  std::string text = replaced(small_seq(), "517642", "1.5168 64.17");
  const Surface surface = read(text).surfaces[1];
  EXPECT_EQ(surface.nd, 1.5168);
  EXPECT_EQ(surface.vd, 64.17);
  EXPECT_EQ(surface.glass, "");
}

TEST(SeqReader, ReadsVignettingOfFields) {
  const LensDesign lens = read(small_seq("", "YAN 0 10; VUY 0 0.4; VLY 0 0.25; VUX 0 0.1; VLX 0 0.1"));
  ASSERT_EQ(lens.fields.size(), 2U);
  EXPECT_FALSE(lens.fields[0].is_cut());
  EXPECT_EQ(lens.fields[1].y, 1);
  EXPECT_EQ(lens.fields[1].cut_above, 0.4);
  EXPECT_EQ(lens.fields[1].cut_below, 0.25);
}

TEST(SeqReader, ReadsPrivateGlasses) {
  const std::string glass = "PRV\nPWL 650 550 480\n'MINE' 1.61 1.62 1.63\nEND";
  const LensDesign known = read(small_seq("GLA MINE", glass));
  EXPECT_EQ(known.surfaces[1].index, 1.62);
  const LensDesign other = read(small_seq("GLA MINE; WL 600", glass));
  EXPECT_EQ(other.surfaces[1].index, 0);
  ASSERT_EQ(other.remarks.size(), 1U);
  EXPECT_THAT(other.remarks[0].text, HasSubstr("'MINE' has no index at the reference wavelength, 600 nm"));
}

TEST(SeqReader, RemarksOnUnknownWords) {
  const LensDesign lens = read(small_seq("CIR EDG 13\nFOO 1 ! why\nCCY 0; THC 0", "VUY 0 0.4"));
  ASSERT_EQ(lens.remarks.size(), 3U);
  EXPECT_THAT(lens.remarks[0].text, HasSubstr("vignetting"));
  EXPECT_EQ(lens.remarks[1].text, "not understood: CIR EDG 13");
  EXPECT_EQ(lens.remarks[2].text, "not understood: FOO 1");
  EXPECT_EQ(lens.remarks[2].line, 12);
  EXPECT_EQ(lens.surfaces[1].clear_radius_mm, 12);
}

TEST(SeqReader, AssumesCodeVsDefaultStop) {
  std::string text = replaced(small_seq(), " STO; ", " ");
  const LensDesign lens = read(text);
  EXPECT_TRUE(lens.surfaces[1].stop);
  ASSERT_EQ(lens.remarks.size(), 1U);
  EXPECT_EQ(lens.remarks[0].text, "assumed: the stop is surface S1, CODE V's default; the file has no STO");
}

TEST(SeqReader, ReadsQTypeAspheresByName) {
  const std::string words = "SPS QCN\nSCO K -0.5\nSCO NRADIUS 10\nSCO QC4 0.2\nSCO QC8 -0.1\n";
  const LensDesign strong = read(small_seq(words));
  ASSERT_TRUE(strong.surfaces[1].q_con.has_value());
  EXPECT_EQ(strong.surfaces[1].conic, -0.5);
  EXPECT_EQ(strong.surfaces[1].q_con->radius_mm, 10);
  EXPECT_EQ(strong.surfaces[1].q_con->coefficients, (std::vector<double>{0.2, 0, -0.1}));
  EXPECT_EQ(strong.remarks[0].text, "surface S1: SPS QCN is read as Forbes's Q_con, QC4, QC6, ... as his a0, a1, ...");
  const LensDesign mild = read(small_seq("SPS QBF 10\nSCO QB4 0.2\n"));
  ASSERT_TRUE(mild.surfaces[1].q_bfs.has_value());
  EXPECT_EQ(mild.surfaces[1].q_bfs->coefficients, (std::vector<double>{0.2}));
  // The numbers of CODE V's coefficients are not public: names alone are read.
  EXPECT_THAT(refusal(small_seq("SPS QCN 10\nSCO C3 0.2\n")),
              HasSubstr("a.seq:12: surface S1: unsupported 'SCO C3' of SPS QCN; supported are K, NRADIUS and QC4"));
  EXPECT_THAT(refusal(small_seq("SPS QCN 10\nSCO QC5 0.2\n")), HasSubstr("unsupported 'SCO QC5' of SPS QCN"));
  EXPECT_THAT(refusal(small_seq("SPS QBF\nSCO QB4 0.2\n")),
              HasSubstr("a.seq:11: surface S1: SPS QBF needs a normalisation radius above 0, found 0"));
}

TEST(SeqReader, RemarksOnAssumedUnit) {
  std::string text = replaced(small_seq(), "DIM M\n", "");
  const LensDesign lens = read(text);
  ASSERT_EQ(lens.remarks.size(), 1U);
  EXPECT_EQ(lens.remarks[0].text, "assumed: lengths in mm; the file has no DIM");
}

TEST(SeqReader, RejectsWithFileAndLine) {
  EXPECT_THAT(refusal("RDM; LEN\n"), HasSubstr("a.seq: no surfaces (SO, S, SI) found"));
  EXPECT_THAT(refusal("WL 550\nSO 0 1e13\nS 50 4 F2\n"), HasSubstr("a.seq:3: the image surface (SI) is missing"));
  EXPECT_THAT(refusal(small_seq("BEN")), HasSubstr("a.seq:11: surface S1: BEN is not supported"));
  EXPECT_THAT(refusal(small_seq("CIR S77 3")), HasSubstr("a.seq:11: CIR: unknown surface 'S77'"));
  EXPECT_THAT(refusal(small_seq("THI 4mm")), HasSubstr("a.seq:11: thickness: expected a number, found '4mm'"));
  EXPECT_THAT(refusal(small_seq("ADE 720")), HasSubstr("ADE: expected a number from -360 to 360"));
  EXPECT_THAT(refusal(small_seq("", "REF 9")), HasSubstr("a.seq:7: REF: the reference wavelength is number 9"));
  EXPECT_THAT(refusal(small_seq("", "DIM FOOT")), HasSubstr("DIM: unknown unit 'FOOT'"));
  EXPECT_THAT(refusal(small_seq("", "WL 0.55")),
              HasSubstr("a.seq:7: WL: expected nanometres from 100 to 100000 (green: 550), found 0.55"));
  EXPECT_THAT(refusal(small_seq("", "WL -5")), HasSubstr("(green: 550), found -5"));
}

}  // namespace
}  // namespace relign::lens_files::seq_reader
