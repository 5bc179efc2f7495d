// CODE V's printed listing: the paper's lens, extra lines below rows, every refusal with its line.
#include "lens_files/listing_reader.h"

#include <gmock/gmock.h>

#include "error_text.h"
#include "golden_lens.h"

namespace relign::lens_files::listing_reader {
namespace {

using test::error_text;
using testing::ElementsAre;
using testing::HasSubstr;

std::string edited(const std::string& from, const std::string& to) {
  std::string text = golden_bytes("relign_od.lis");
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}
LensDesign read(const std::string& text) { return read_listing(text, "a.lis"); }
std::string refusal(const std::string& text) {
  return error_text(ErrorKind::bad_input, [&] { read(text); });
}

TEST(ListingReader, ReadsThePapersLens) {
  const LensDesign lens = golden_design("relign_od.lis");
  EXPECT_EQ(lens.title, "JAPANESE PATENT 61-46807");
  ASSERT_EQ(lens.surfaces.size(), 11U);
  EXPECT_DOUBLE_EQ(1 / lens.surfaces[4].curvature, -65.8388);
  EXPECT_EQ(lens.surfaces[1].glass, "487490.704058");
  EXPECT_EQ(lens.surfaces[1].index, 1.487439);  // of the table of refractive indices
  EXPECT_EQ(lens.surfaces[8].index, 1.555431);
  EXPECT_EQ(lens.surfaces[3].label, "STO");
  EXPECT_TRUE(lens.surfaces[3].stop);
  EXPECT_EQ(lens.surfaces[3].clear_radius_mm, 1.367413);
  EXPECT_EQ(lens.surfaces[9].clear_radius_mm, 2.539485);
  EXPECT_EQ(lens.surfaces[10].thickness_mm, -0.04754);
  EXPECT_EQ(lens.aperture.kind, SystemAperture::f_number);
  EXPECT_EQ(lens.wavelength_nm, 589);
  EXPECT_EQ(lens.field.value, 42.05);
  EXPECT_EQ(lens.published.at("exit_pupil_from_last"), -4.9663);
  EXPECT_EQ(lens.published.size(), 11U);
  ASSERT_EQ(lens.remarks.size(), 1U);
  EXPECT_THAT(lens.remarks[0].text, HasSubstr("vignetting"));
}

TEST(ListingReader, ReadsLinesBelowARow) {
  const LensDesign lens = read(edited("    2: ",
                                      "      ASP:\n"
                                      "      K  :  -0.500000   KC :      100\n"
                                      "      IC :       YES   CUF:  0.000000   CCF:  100\n"
                                      "      A  :0.100000E-03  B :0.000000E+00  C :-.2E-07  D :0.000000E+00\n"
                                      "      AC :         100  BC :         100  CC :  100  DC :  100\n"
                                      "      XDE:  0.100000   YDE:  0.000000   ZDE:  0.000000  DAR\n"
                                      "      XDC:      100    YDC:      100    ZDC:      100\n"
                                      "      ADE:  0.000000   BDE:  1.000000   CDE:  0.000000\n"
                                      "    2: "));
  const Surface& surface = lens.surfaces[1];
  EXPECT_EQ(surface.conic, -0.5);
  EXPECT_THAT(surface.even_asphere, ElementsAre(0, 1e-4, 0, -0.2e-7, 0));
  ASSERT_TRUE(surface.before && surface.after);
  EXPECT_EQ(surface.before->translation.x, 0.1);
  EXPECT_LT(surface.before->rotation[2], 0);  // left-handed about y
  EXPECT_EQ(lens.remarks.size(), 1U);
}

TEST(ListingReader, SixDigitCodesAreGlassesAndFlagsAreNot) {
  const LensDesign lens = read(edited("487490.704058        0", "       517642        0"));
  EXPECT_EQ(lens.surfaces[1].glass, "517642");
  EXPECT_EQ(lens.surfaces[2].glass, "");
  EXPECT_EQ(lens.surfaces[9].glass, "");  // PIM is a solve
}

TEST(ListingReader, RemarksOnUnknownWords) {
  const LensDesign lens = read(edited("   WTW ", "   FROBNICATION 3\n   WTW "));
  ASSERT_EQ(lens.remarks.size(), 2U);
  EXPECT_EQ(lens.remarks[0].line, 20);
  EXPECT_EQ(golden_design("relign_od.lis").remarks.size(), 1U);
}

TEST(ListingReader, RejectsWithFileAndLine) {
  EXPECT_THAT(refusal("nothing\n"), HasSubstr("a.lis: no surface table"));
  const std::string whole = golden_bytes("relign_od.lis");
  EXPECT_THAT(refusal(whole.substr(0, whole.find("    7: "))), HasSubstr("the row of the image (IMG:) is missing"));
  EXPECT_THAT(refusal(edited("    6: ", "    7: ")), HasSubstr("a.lis:9: expected surface 6, found '7'"));
  EXPECT_THAT(refusal(edited("1.500000", "1.5x")), HasSubstr("a.lis:4: thickness: expected a number, found '1.5x'"));
  EXPECT_THAT(refusal(edited("CIR S9", "CIR S90")), HasSubstr("CIR: unknown surface 'S90'"));
  EXPECT_THAT(refusal(edited("1.487439", "1.4 1.5")), HasSubstr("expected 1, one per wavelength, found 2"));
}

}  // namespace
}  // namespace relign::lens_files::listing_reader
