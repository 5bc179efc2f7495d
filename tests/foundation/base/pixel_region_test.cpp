#include "base/pixel_region.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "error_text.h"

namespace relign {
namespace {

using testing::HasSubstr;

TEST(PixelRegion, SpansHaveEveryPixelOnce) {
  constexpr std::size_t kWidth = 20, kHeight = 12;
  for (const PixelRegions& regions :
       std::vector<PixelRegions>{{},
                                 {{3, 2, 1, 1}},
                                 {{0, 0, 20, 12}},
                                 {{5, 1, 4, 4}, {7, 3, 6, 5}, {5, 1, 4, 4}},   // overlapping, repeated
                                 {{10, 0, 5, 3}, {0, 0, 5, 3}, {5, 0, 5, 3}},  // side by side
                                 {{0, 4, 20, 1}, {2, 0, 3, 12}, {19, 11, 1, 1}},
                                 {{2, 2, 10, 8}, {4, 4, 2, 2}}}) {  // one in the other
    std::vector<int> wanted(kWidth * kHeight), found = wanted;
    for (const PixelRegion& region : regions)
      for (std::uint32_t row = region.row; row < region.row + region.rows; ++row)
        for (std::uint32_t column = region.column; column < region.column + region.columns; ++column)
          wanted[row * kWidth + column] = 1;
    std::size_t end = 0;
    for (const PixelSpan& span : spans_of(regions, kWidth)) {
      EXPECT_GE(span.first, end) << "in order";
      EXPECT_EQ(span.first / kWidth, (span.first + span.count - 1) / kWidth) << "of one row";
      end = span.first + span.count;
      for (std::size_t i = span.first; i < end; ++i) ++found[i];
    }
    EXPECT_EQ(found, wanted) << to_json_text(regions);
  }
}

TEST(PixelRegion, ReadsBack) {
  const PixelRegions regions = {{1, 2, 3, 4}, {0, 4294967295, 1, 1}};
  EXPECT_EQ(to_json_text(regions), "[[1,2,3,4],[0,4294967295,1,1]]");
  EXPECT_EQ(read_regions(Json::parse(to_json_text(regions))), regions);
  EXPECT_EQ(to_regions(to_numbers(regions).data(), 2), regions);
  EXPECT_EQ(to_json_text({}), "[]");
}

TEST(PixelRegion, RejectsOtherJson) {
  for (const char* text :
       {"null", "{}", "[1,2,3,4]", "[[1,2,3]]", "[[1,2,3,-4]]", "[[1,2,3,4.5]]", "[[1,2,3,4294967296]]"})
    EXPECT_THAT(test::error_text(ErrorKind::bad_input, [&] { read_regions(Json::parse(text)); }),
                HasSubstr(std::string("non-negative integers, found ") + text));
}

TEST(PixelRegion, StatesMistakes) {
  EXPECT_EQ(mistake_of({{0, 0, 20, 12}, {19, 11, 1, 1}}, 20, 12), "");
  EXPECT_THAT(mistake_of({{0, 0, 21, 1}}, 20, 12), HasSubstr("20 columns and 12 rows"));
  EXPECT_THAT(mistake_of({{1, 4294967295, 1, 4294967295}}, 20, 12), HasSubstr("[1,4294967295,1,4294967295]"));
  EXPECT_THAT(mistake_of({{0, 0, 0, 5}}, 20, 12), HasSubstr("at least one pixel"));
  EXPECT_THAT(mistake_of(PixelRegions(kMaxRegions + 1, {0, 0, 1, 1}), 20, 12), HasSubstr("at most 256"));
}

}  // namespace
}  // namespace relign
