// Encodings, line ends, words and numbers of design programs' files.
#include "lens_files/text_lines.h"

#include <gmock/gmock.h>

#include "error_text.h"
#include "lens_files/lens_design.h"

namespace relign::lens_files {
namespace {

using test::error_text;
using testing::ElementsAre;
using testing::HasSubstr;

const char* const kTwoLines = "Linse f\u00fcr \u03b2\nzweite\n";  // UTF-8

std::string utf16(const std::u16string& text, bool big_endian, bool mark) {
  std::string bytes = mark ? (big_endian ? "\xFE\xFF" : "\xFF\xFE") : "";
  for (const char16_t unit : text) {
    const char high = static_cast<char>(unit >> 8), low = static_cast<char>(unit & 0xFF);
    bytes += big_endian ? high : low;
    bytes += big_endian ? low : high;
  }
  return bytes;
}

void expect_two_lines(const std::string& bytes) {
  const std::vector<TextLine> lines = text_lines(bytes, "a.zmx");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].text, "Linse f\u00fcr \u03b2");
  EXPECT_EQ(lines[1].text, "zweite");
  EXPECT_EQ(lines[1].number, 2);
}

TEST(TextLines, EveryEncodingGivesTheSameText) {
  expect_two_lines(kTwoLines);
  expect_two_lines(std::string("\xEF\xBB\xBF") + kTwoLines);
  const std::u16string wide = u"Linse f\u00fcr \u03b2\r\nzweite";
  for (const bool big_endian : {false, true})
    for (const bool mark : {false, true}) expect_two_lines(utf16(wide, big_endian, mark));
  EXPECT_EQ(text_lines("f\xFCr\rx", "a.zmx")[0].text, "f\u00fcr");  // Latin-1
  EXPECT_EQ(text_lines(utf16(u"\U0001F600", false, true), "a.zmx")[0].text, "\U0001F600");
}

TEST(TextLines, RejectsBinaryFilesByName) {
  EXPECT_EQ(error_text(ErrorKind::bad_input, [] { text_lines("", "a.zmx"); }), "a.zmx: the file is empty");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [] { text_lines(std::string("SURF\0abcdef", 11), "a.zmx"); }),
              HasSubstr("a.zmx: expected a text file"));
  const std::string long_text(kMaxBytes + 1, ' ');
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { text_lines(long_text, "a.zmx"); }), HasSubstr("at most 16"));
}

TEST(TextLines, WordsKeepQuotedBlanks) {
  EXPECT_THAT(words_of("  COFN\tQF \"MY COATING.DAT\" 'a b' \"open"),
              ElementsAre("COFN", "QF", "MY COATING.DAT", "a b", "open"));
}

TEST(TextLines, ParsesNumbers) {
  EXPECT_EQ(parse_number("1.5E+1"), 15.0);
  EXPECT_EQ(parse_number("+0.1D-2"), 0.001);
  EXPECT_EQ(parse_number("1,62041"), 1.62041);
  EXPECT_EQ(parse_number(".5"), 0.5);
  for (const char* wrong : {"", "abc", "inf", "nan", "1.5mm", "1,000,000", "1e999", "--1"})
    EXPECT_FALSE(parse_number(wrong)) << wrong;
}

TEST(TextLines, ShownCutsBetweenCharacters) {
  EXPECT_EQ(shown("\u00fc\u00fc\u00fc", 2), "\u00fc...");
  EXPECT_EQ(shown("a\x01z", 10), "a?z");
}

}  // namespace
}  // namespace relign::lens_files
