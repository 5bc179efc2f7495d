#include "base/text.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"

namespace relign {
namespace {

TEST(Text, ShortestReadsBack) {
  EXPECT_EQ(shortest(0.1), "0.1");
  EXPECT_EQ(shortest(1.0 / 3), "0.3333333333333333");
  EXPECT_EQ(shortest(1e300), "1e+300");
}

TEST(Text, SignificantIsForPeople) {
  EXPECT_EQ(significant(0.033712), "0.0337");
  EXPECT_EQ(significant(123.456), "123");
  EXPECT_EQ(significant(1234567.0), "1.23e+06");
  EXPECT_EQ(significant(0), "0");
  EXPECT_EQ(significant(std::nan("")), "-");
}

TEST(Text, NearestNameIgnoresDashAndUnderscore) {
  EXPECT_EQ(nearest_name("nlopt_sbplex", {"nlopt-sbplx", "random"}), "nlopt-sbplx");
  EXPECT_EQ(nearest_name("relign_do", {"relign_l2", "relign_od"}), "relign_od") << "two letters swapped are one slip";
  EXPECT_EQ(nearest_name("zebra", {"nlopt-sbplx", "random"}), "");
  EXPECT_EQ(suggestion("zebra", {"home", "random"}), "; known: home, random");
}

TEST(Text, HexadecimalDigitsReadBack) {
  std::string bytes;
  for (int byte = 0; byte < 256; ++byte) bytes += static_cast<char>(byte);
  EXPECT_EQ(to_hex(std::string_view("\x00\x9f\xff", 3)), "009fff");
  EXPECT_EQ(from_hex(to_hex(bytes)), bytes);
  for (const char* wrong : {"0", "0g", "0A", " 0"}) EXPECT_THROW(from_hex(wrong), Error) << wrong;
}

}  // namespace
}  // namespace relign
