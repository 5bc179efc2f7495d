// Zemax surface types: terms of PARM and XDAT, and errors with surface and line.
#include "lens_files/zmx_shape.h"

#include <gmock/gmock.h>

#include "error_text.h"
#include "golden_lens.h"

namespace relign::lens_files::zmx_shape {
namespace {

using test::error_text;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

LensDesign read(const std::string& text) { return read_zmx(text, "a.zmx"); }
Surface surface(const std::string& lines) { return read(small_zmx(lines)).surfaces[1]; }
std::string refusal(const std::string& lines) {
  return error_text(ErrorKind::bad_input, [&] { read(small_zmx(lines)); });
}

TEST(ZmxShape, ReadsExtendedAspheres) {
  // Coefficients are of (r / 2)^2, (r / 2)^4, ...
  const std::string lines =
      "  TYPE XASPHERE\n  CONI -3\n  XDAT 1 4\n  XDAT 2 2\n  XDAT 3 0.8\n  XDAT 4 1.6\n  XDAT 6 -2.56\n";
  EXPECT_EQ(surface(lines).conic, -3);
  EXPECT_THAT(surface(lines).even_asphere, ElementsAre(0.2, 0.1, 0, -0.01));
  EXPECT_THAT(surface("  TYPE XASPHERE\n  XDAT 1 0\n  XDAT 2 0\n").even_asphere, IsEmpty());
}

TEST(ZmxShape, ReadsTermsUpToR32) {
  const std::string lines = "  TYPE XASPHERE\n  XDAT 1 17\n  XDAT 2 1\n  XDAT 18 1e-9\n";
  ASSERT_EQ(surface(lines).even_asphere.size(), 16U);
  EXPECT_EQ(surface(lines).even_asphere.back(), 1e-9);
  EXPECT_THAT(surface(lines + "  XDAT 19 0\n").even_asphere.size(), 16U);
  EXPECT_THAT(refusal(lines + "  XDAT 19 1e-9\n"),
              HasSubstr("a.zmx:19: surface 1 has a term of r^34; supported are terms up to r^32"));
}

TEST(ZmxShape, RoundsFractionalTermCountDown) {
  const LensDesign lens = read(small_zmx("  TYPE XASPHERE\n  XDAT 1 1.5\n  XDAT 2 1\n  XDAT 3 1e-3\n"));
  EXPECT_THAT(lens.surfaces[1].even_asphere, ElementsAre(1e-3));
  ASSERT_EQ(lens.remarks.size(), 1U);
  EXPECT_EQ(lens.remarks[0].text, "surface 1: XDAT 1 states 1.5 terms; 1 is read");
}

TEST(ZmxShape, UsesNoMoreTermsThanStated) {
  const LensDesign lens = read(small_zmx("  TYPE XASPHERE\n  XDAT 1 1\n  XDAT 2 1\n  XDAT 3 1e-3\n  XDAT 4 1\n"));
  EXPECT_THAT(lens.surfaces[1].even_asphere, ElementsAre(1e-3));
  ASSERT_EQ(lens.remarks.size(), 1U);
  EXPECT_EQ(lens.remarks[0].text, "not used: terms beyond the 1 that XDAT 1 states for surface 1");
  EXPECT_EQ(lens.remarks[0].line, 19);
}

TEST(ZmxShape, RejectsInvalidTermCount) {
  EXPECT_THAT(refusal("  TYPE XASPHERE\n  XDAT 1 -2.5\n  XDAT 2 1\n"),
              HasSubstr("a.zmx:16: surface 1: XDAT 1: expected a number of terms from 0 to 240, found -2.5"));
  EXPECT_THAT(refusal("  TYPE QED_TYPE\n  XDAT 1 0\n  XDAT 2 1.5\n  XDAT 3 1\n"),
              HasSubstr("a.zmx:17: surface 1: XDAT 2: expected an integer number of terms from 0 to 30, found 1.5"));
}

TEST(ZmxShape, ReadsOddAspheres) {
  const Surface odd = surface("  TYPE ODDASPHE\n  PARM 2 2e-3\n  PARM 3 3e-4\n  PARM 4 4e-5\n  PARM 5 5e-6\n");
  EXPECT_THAT(odd.even_asphere, ElementsAre(2e-3, 4e-5));
  EXPECT_THAT(odd.odd_asphere, ElementsAre(3e-4, 5e-6));
  const Surface extended =
      surface("  TYPE XOSPHERE\n  XDAT 1 5\n  XDAT 2 2\n  XDAT 5 8e-3\n  XDAT 6 16e-4\n  XDAT 7 32e-5\n");
  EXPECT_THAT(extended.even_asphere, ElementsAre(0, 1e-4));
  EXPECT_THAT(extended.odd_asphere, ElementsAre(1e-3, 1e-5));
  EXPECT_THAT(refusal("  TYPE ODDASPHE\n  PARM 1 0.1\n"), HasSubstr("a.zmx:16: surface 1 has a term of r, 0.1"));
}

TEST(ZmxShape, ReadsQTypeAspheres) {
  const std::string lines = "  TYPE QED_TYPE\n  XDAT 1 0\n  XDAT 2 3\n  XDAT 3 27\n  XDAT 4 -0.8\n  XDAT 5 0.1\n";
  const Surface bfs = surface(lines);
  ASSERT_TRUE(bfs.q_bfs.has_value());
  EXPECT_FALSE(bfs.q_con.has_value());
  EXPECT_EQ(bfs.q_bfs->radius_mm, 27);
  EXPECT_THAT(bfs.q_bfs->coefficients, ElementsAre(-0.8, 0.1));
  EXPECT_TRUE(surface(lines + "  XDAT 1 1\n").q_con.has_value());
  EXPECT_THAT(refusal(lines + "  XDAT 1 2\n"), HasSubstr("surface 1: XDAT 1: unsupported Q-type '2'; supported are"));
}

TEST(ZmxShape, ScalesTermsWithTheUnit) {
  std::string text = replaced(small_zmx("  TYPE ODDASPHE\n  PARM 3 1\n  PARM 4 1\n"), "UNIT MM", "UNIT CM");
  const Surface scaled = read(text).surfaces[1];
  EXPECT_DOUBLE_EQ(scaled.odd_asphere[0], 1e-2);
  EXPECT_DOUBLE_EQ(scaled.even_asphere[1], 1e-3);
  text = small_zmx("  TYPE QED_TYPE\n  XDAT 2 1\n  XDAT 3 2\n  XDAT 4 0.5\n");
  text = replaced(text, "UNIT MM", "UNIT CM");
  EXPECT_DOUBLE_EQ(read(text).surfaces[1].q_bfs->radius_mm, 20);
  EXPECT_DOUBLE_EQ(read(text).surfaces[1].q_bfs->coefficients[0], 5);
}

TEST(ZmxShape, RejectsWithSurfaceAndLine) {
  EXPECT_THAT(refusal("  TYPE XASPHERE\n  XDAT 1 2\n  XDAT 2 0\n"),
              HasSubstr("a.zmx:16: surface 1: XDAT 2: expected a normalisation radius above 0, found 0"));
  EXPECT_THAT(refusal("  TYPE XASPHERE\n  XDAT 1 16\n  XDAT 2 1e-20\n  XDAT 18 1\n"),
              HasSubstr("surface 1: the term of r^32 is too large with a normalisation radius of 1e-20"));
  EXPECT_THAT(refusal("  TYPE XASPHERE\n  XDAT 1 999\n"),
              HasSubstr("surface 1: XDAT 1: expected a number of terms from 0 to 240, found 999"));
  EXPECT_THAT(refusal("  TYPE SZERNSAG\n"),
              HasSubstr("a.zmx:15: surface 1 has unsupported type 'SZERNSAG'; supported are"));
}

}  // namespace
}  // namespace relign::lens_files::zmx_shape
