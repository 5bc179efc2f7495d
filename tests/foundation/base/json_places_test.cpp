// Property: in random documents, the position reported for a value is the position of its text. The documents
// are written here piece by piece, so that the positions are known independently of any parser.
#include <gtest/gtest.h>

#include <map>
#include <relign/random.hpp>
#include <string>

#include "base/json_source.h"

namespace relign {
namespace {

class Writer {
 public:
  explicit Writer(std::uint64_t seed) : random_(seed) {
    space();
    value("", 0);
    space();
  }
  const std::string& text() const { return text_; }
  const std::map<std::string, std::size_t>& places() const { return places_; }  // JSON pointer -> first byte

 private:
  template <std::size_t Count>
  const char* any(const char* const (&choices)[Count]) {
    return choices[random_.below(Count)];
  }
  void space() {
    for (std::uint64_t i = random_.below(4); i > 0; --i) text_ += any({" ", "\n", "\t", "\r\n", "  "});
  }
  void value(const std::string& pointer, int depth) {
    places_[pointer] = text_.size();
    const std::uint64_t kind = depth == 0 ? 4 + random_.below(4) : random_.below(depth < 5 ? 8 : 5);
    if (kind < 2)
      text_ += any({"0", "-0", "7", "-12", "3.25", "-1e-3", "1E+5", "123456789012345678", "0.1e2"});
    else if (kind < 4)
      text_ += any(
          {"\"\"", "\"a b\"", R"("x\"y\\")", R"("],}:{[")", R"("\u00e9\n\/")", "\"\xc3\xa9\xe2\x82\xac\"", "\"1\""});
    else if (kind == 4)
      text_ += any({"true", "false", "null"});
    else if (kind == 5)
      array(pointer, depth);
    else
      object(pointer, depth);
  }
  void array(const std::string& pointer, int depth) {
    text_ += '[';
    space();
    const std::uint64_t count = random_.below(5);
    for (std::uint64_t i = 0; i < count; ++i) {
      if (i > 0) separator(",");
      value(pointer + "/" + std::to_string(i), depth + 1);
    }
    space();
    text_ += ']';
  }
  void object(const std::string& pointer, int depth) {
    // As written in the document, and as a token of a JSON pointer.
    static const std::pair<const char*, const char*> keys[] = {
        {"\"a\"", "a"},           {"\"\"", ""},         {"\"a/b\"", "a~1b"},          {"\"~\"", "~0"},
        {R"("\"")", "\""},        {R"("\u0041")", "A"}, {"\"\xc3\xa9\"", "\xc3\xa9"}, {"\"7\"", "7"},
        {R"("{\\n,:")", "{\\n,:"}};
    text_ += '{';
    space();
    bool first = true;
    for (const auto& [written, token] : keys) {
      if (random_.below(3) > 0) continue;
      if (!first) separator(",");
      first = false;
      text_ += written;
      separator(":");
      value(pointer + "/" + token, depth + 1);
    }
    space();
    text_ += '}';
  }
  void separator(const char* sign) {
    space();
    text_ += sign;
    space();
  }

  Random random_;
  std::string text_;
  std::map<std::string, std::size_t> places_;
};

TEST(JsonPlaces, MatchPositionsInRandomDocuments) {
  std::size_t checked = 0;
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    const Writer written(seed);
    SCOPED_TRACE("seed " + std::to_string(seed) + ": " + written.text());
    const JsonSource source = JsonSource::from_text(written.text(), "random.json");
    ASSERT_EQ(source.root(), Json::parse(written.text()));
    for (const auto& [pointer, offset] : written.places()) {
      ASSERT_TRUE(pointer.empty() || source.root().contains(Json::json_pointer(pointer))) << pointer;
      int line = 1, column = 1;
      for (std::size_t i = 0; i < offset; ++i) {
        ++column;
        if (written.text()[i] != '\n') continue;
        ++line;
        column = 1;
      }
      const Problem problem = source.problem(pointer, "");
      ASSERT_EQ(problem.line, line) << pointer;
      ASSERT_EQ(problem.column, column) << pointer;
      ++checked;
    }
  }
  EXPECT_GT(checked, 20000u) << "the documents are not all trivial";
}

}  // namespace
}  // namespace relign
