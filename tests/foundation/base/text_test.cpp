#include "base/text.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "base/characters.h"
#include "base/error.h"

namespace relign {
namespace {

TEST(Text, ShortestRoundTrips) {
  EXPECT_EQ(shortest(0.1), "0.1");
  EXPECT_EQ(shortest(1.0 / 3), "0.3333333333333333");
  EXPECT_EQ(shortest(1e300), "1e+300");
}

TEST(Text, SignificantRoundsToThreeDigits) {
  EXPECT_EQ(significant(0.033712), "0.0337");
  EXPECT_EQ(significant(123.456), "123");
  EXPECT_EQ(significant(1234567.0), "1.23e+06");
  EXPECT_EQ(significant(0), "0");
  EXPECT_EQ(significant(std::nan("")), "-");
}

TEST(Text, FixedHasTheGivenDecimals) {
  EXPECT_EQ(fixed(-7.745581, 5), "-7.74558");
  EXPECT_EQ(fixed(2, 3), "2.000");
  EXPECT_EQ(fixed(1e300, 1).size(), 303U);
}

TEST(Text, PrintableEscapesControlsAndInvalidUtf8) {
  EXPECT_EQ(printable("plain \xc3\xa4 \xe2\x82\xac \xf0\x9f\x94\xad\n\t"),
            "plain \xc3\xa4 \xe2\x82\xac \xf0\x9f\x94\xad\n\t");
  EXPECT_EQ(printable("\x1b[2J"), "\\x1b[2J");
  EXPECT_EQ(printable(std::string_view("a\0b\r\x7f", 5)), "a\\x00b\\x0d\\x7f");
  EXPECT_EQ(printable("\xc2\x9b"), "\\x9b") << "a control character of two bytes";
  EXPECT_EQ(printable("\xe2\x80\xae"), "\\u202e") << "changes the writing direction";
  EXPECT_EQ(printable("\u200f\u061c\u2066"), "\\u200f\\u061c\\u2066") << "so do these";
  EXPECT_EQ(printable("ran\u200bdom"), "ran\\u200bdom") << "looks like another name";
  EXPECT_EQ(printable("ran\u00addom\U000e0041"), "ran\\xaddom\\U000e0041") << "so do these";
  EXPECT_EQ(printable("\u0645\u06cc\u200c\u062e"), "\u0645\u06cc\u200c\u062e") << "Persian needs its joiners";
  EXPECT_EQ(printable("\xff"), "\\xff");
  EXPECT_EQ(printable("\xe2\x82"), "\\xe2\\x82") << "truncated";
  EXPECT_EQ(printable("\xc0\xaf"), "\\xc0\\xaf") << "overlong encoding of a slash";
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "UTF-16 surrogate";
}

TEST(Text, ALineHasNoHiddenCharacters) {
  EXPECT_EQ(line_mistake("Lens lab, \u00c5ngstr\u00f6m \u05d0\u05d1"), "");
  for (const char* text : {"a\nb", "a\tb", "a\x1b[2J", "a\u202eb", "\u200f", "\u2069", "a\u2029", "\u00ad", "\xff"})
    EXPECT_EQ(line_mistake(text), "line ends, control characters and marks of the writing direction are not allowed")
        << printable(text);
}

TEST(Names, HaveLettersOfOneScript) {
  for (const char* name : {"bo-gp", "nlopt (2)", "M\u00fcller", "\u03b1\u03b2-\u03c3", "\u043f\u043e\u0438\u0441\u043a",
                           "\u4f18\u5316 GP", "42", "\u0561\u0562"})
    EXPECT_EQ(letters_mistake(name), "") << name;
  for (const char* name :
       {"b\u043e-gp", "\u0391lpha", "\U0001d41b\U0001d428", "\uff42\uff4f", "r\u0251ndom", "\u0440\u03bf"})
    EXPECT_THAT(letters_mistake(name), testing::HasSubstr("of one script")) << name;
  for (const char* name : {"\u0440\u0440\u043e", "\u039f\u03a1\u03a4", "\u0585-1"})
    EXPECT_THAT(letters_mistake(name), testing::HasSubstr("all look like Latin ones")) << name;
}

TEST(ErrorText, IsPrintableAndTruncated) {
  const Error error(ErrorKind::bad_input, "unknown \x1b[31mname\n" + std::string(2 * kLongestError, 'x'));
  EXPECT_EQ(std::string(error.what()).rfind("unknown \\x1b[31mname\nxx", 0), 0u);
  EXPECT_LT(std::string(error.what()).size(), kLongestError + 100);
}

TEST(ErrorText, ListsTheFirstMistakesAndCountsTheOthers) {
  std::vector<Problem> problems(kMaxProblems + 7);
  for (Problem& problem : problems) problem.message = "wrong";
  try {
    throw_if_any(problems);
    FAIL();
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_EQ(static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')), kMaxProblems);
    EXPECT_EQ(text.substr(text.rfind('\n') + 1), "and 7 more mistakes");
  }
}

TEST(Text, NearestNameIgnoresDashAndUnderscore) {
  EXPECT_EQ(nearest_name("nlopt_sbplex", {"nlopt-sbplx", "random"}), "nlopt-sbplx");
  EXPECT_EQ(nearest_name("relign_do", {"relign_l2", "relign_od"}), "relign_od") << "a transposition is one edit";
  EXPECT_EQ(nearest_name("zebra", {"nlopt-sbplx", "random"}), "");
  EXPECT_EQ(suggestion("zebra", {"home", "random"}), "; allowed: home, random");
}

TEST(Text, HexRoundTrips) {
  std::string bytes;
  for (int byte = 0; byte < 256; ++byte) bytes += static_cast<char>(byte);
  EXPECT_EQ(to_hex(std::string_view("\x00\x9f\xff", 3)), "009fff");
  EXPECT_EQ(from_hex(to_hex(bytes)), bytes);
  for (const char* wrong : {"0", "0g", "0A", " 0"}) EXPECT_THROW(from_hex(wrong), Error) << wrong;
}

}  // namespace
}  // namespace relign
