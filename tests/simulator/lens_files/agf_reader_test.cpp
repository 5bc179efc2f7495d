// Glass catalogues: names, formulas, coefficients, ranges; errors.
#include "lens_files/agf_reader.h"

#include <gmock/gmock.h>

#include "error_text.h"
#include "golden_lens.h"

namespace relign::lens_files::agf_reader {
namespace {

using test::error_text;
using testing::HasSubstr;

std::string refusal(const std::string& text) {
  return error_text(ErrorKind::bad_input, [&] { read_agf(text, "a.agf"); });
}

TEST(AgfReader, ReadsGlasses) {
  const std::vector<CatalogueGlass> glasses = read_agf(golden_bytes("cooke.agf"), "cooke.agf");
  ASSERT_EQ(glasses.size(), 2U);
  EXPECT_EQ(glasses[0].name, "SK16");
  EXPECT_EQ(glasses[0].formula, 1);
  ASSERT_EQ(glasses[0].coefficients.size(), 10U);
  EXPECT_EQ(glasses[0].coefficients[0], 2.592001);
  EXPECT_EQ(glasses[0].low_um, 0.31);
  EXPECT_EQ(glasses[0].high_um, 2.5);
  EXPECT_EQ(glasses[1].name, "F2");
  EXPECT_EQ(glasses[1].nd, 1.62004);
  EXPECT_EQ(glasses[1].vd, 36.366);
}

TEST(AgfReader, RejectsWithFileAndLine) {
  EXPECT_THAT(refusal("CC nothing\n"), HasSubstr("a.agf: no glass (NM) found"));
  EXPECT_THAT(refusal("NM F2 2 620364 1.62 36.4\n"), HasSubstr("a.agf:1: glass 'F2' has no coefficients (CD)"));
  EXPECT_THAT(refusal("NM F2 99 620364 1.62 36.4\nCD 1\n"), HasSubstr("expected a formula from 1 to 13, found 99"));
  EXPECT_THAT(refusal("NM F2 2 620364 1.62 36.4\nCD 1 z\n"), HasSubstr("a.agf:2: CD: expected a number, found 'z'"));
  EXPECT_THAT(refusal("NM\nCD 1\n"), HasSubstr("a.agf:1: NM: missing name of the glass"));
}

}  // namespace
}  // namespace relign::lens_files::agf_reader
