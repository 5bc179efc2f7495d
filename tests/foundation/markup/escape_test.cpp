#include "markup/escape.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "markup/html_writer.h"

namespace relign {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Escape, HtmlEscapesMarkupAndReplacesControls) {
  EXPECT_EQ(html_escaped("<a href=\"x\">'&'</a>"), "&lt;a href=&quot;x&quot;&gt;&#39;&amp;&#39;&lt;/a&gt;");
  EXPECT_EQ(html_escaped("a\nb\tc\r"), "a\nb\tc");
  EXPECT_EQ(html_escaped(std::string_view("\0\x1b[31m", 6)), "\xEF\xBF\xBD\xEF\xBF\xBD[31m");
  EXPECT_EQ(html_escaped("\xCE\xBC"), "\xCE\xBC") << "other scripts are unchanged";
}

TEST(Escape, JsonCannotCloseTheScriptElement) {
  const Json value = {{"</script><!--", "<script>&"}};
  const std::string text = json_for_script(value);
  EXPECT_THAT(text, Not(HasSubstr("<")));
  EXPECT_THAT(text, Not(HasSubstr(">")));
  EXPECT_EQ(Json::parse(text), value) << "the value is unchanged";
  EXPECT_NO_THROW(json_for_script("broken \xff UTF-8"));
}

TEST(Escape, TerminalTextHasNoControlCharacters) {
  EXPECT_EQ(terminal_text("a\x1b[2Jb\n\x7f"), "a?[2Jb??");
  EXPECT_EQ(terminal_text("\xC2\x9B"
                          "31m"),
            "?31m")
      << "C1's one-character escape";
  EXPECT_EQ(terminal_text("\xC2\xB5m"), "\xC2\xB5m") << "the micro sign is not a control character";
}

TEST(Escape, MarksOfTheWritingDirectionAreReplaced) {
  EXPECT_EQ(html_escaped("a\u202eb\u200f<\u00b5"), "a\ufffdb\ufffd&lt;\u00b5");
  EXPECT_EQ(html_escaped("a\u2066\u2028\x85"), "a\ufffd\ufffd\ufffd");
  EXPECT_EQ(terminal_text("a\u202eb"), "a?b");
  EXPECT_EQ(markdown_text("a\u200eb"), "a?b");
  EXPECT_EQ(csv_field("a\u2067b"), "a?b");
}

TEST(Escape, ColumnsCountCodePoints) {
  EXPECT_EQ(columns("\xC2\xB5m"), 2u);
  EXPECT_EQ(clipped("abcdefgh", 8), "abcdefgh");
  EXPECT_EQ(clipped("abcdefghi", 8), "abcde...");
  EXPECT_EQ(clipped("\xC2\xB5\xC2\xB5\xC2\xB5\xC2\xB5\xC2\xB5", 4), "\xC2\xB5...") << "never splits a character";
}

// Test vectors of RFC 4648, section 10.
TEST(Escape, Base64MatchesRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xff\xfe"), "///+");
}

TEST(HtmlWriterTest, EscapesTextAndClosesOpenElements) {
  HtmlWriter html;
  html.open("p", {{"title", "a\"b"}}).text("<i>").open("b").text("x");
  EXPECT_EQ(html.take(), "<p title=\"a&quot;b\">&lt;i&gt;<b>x</b></p>\n");
}

}  // namespace
}  // namespace relign
