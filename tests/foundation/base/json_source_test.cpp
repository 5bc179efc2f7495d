// Line and column of every kind of value, syntax errors, and all mistakes of an object at once.
#include "base/json_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace relign {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string place(const JsonSource& source, const std::string& pointer) {
  const Problem problem = source.problem(pointer, "");
  return std::to_string(problem.line) + ":" + std::to_string(problem.column);
}

TEST(JsonSource, LocatesEveryValue) {
  const JsonSource source = JsonSource::from_text(R"({
  "a": 12.5,
  "b" : [ true, null,
     "x\"y", {"c~/d": -3} ],
  "e": {} , "f": []
})",
                                                  "s.json");
  EXPECT_EQ(place(source, ""), "1:1");
  EXPECT_EQ(place(source, "/a"), "2:8");
  EXPECT_EQ(place(source, "/b"), "3:9");
  EXPECT_EQ(place(source, "/b/0"), "3:11");
  EXPECT_EQ(place(source, "/b/1"), "3:17");
  EXPECT_EQ(place(source, "/b/2"), "4:6");
  EXPECT_EQ(place(source, "/b/3"), "4:14");
  EXPECT_EQ(place(source, "/b/3/c~0~1d"), "4:23");
  EXPECT_EQ(place(source, "/e"), "5:8");
  EXPECT_EQ(place(source, "/f"), "5:18");
  EXPECT_EQ(place(source, "/b/9"), "3:9") << "a missing value has the place of its nearest ancestor";
  EXPECT_EQ(source.root().at("b").at(2), "x\"y");
}

std::string failure(const std::string& text) {
  try {
    JsonSource::from_text(text, "bad.json");
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.what();
  }
  return "no error";
}

TEST(JsonSource, SyntaxErrorsNameLineAndColumn) {
  EXPECT_THAT(failure("{\n  \"a\": 1,\n  b\n}"), HasSubstr("bad.json:3:3: invalid JSON"));
  EXPECT_THAT(failure(""), HasSubstr("bad.json:1:1"));
  EXPECT_THAT(failure("{\"a\": 1"), HasSubstr("bad.json:1:"));
  EXPECT_THAT(failure("{} x"), HasSubstr("invalid JSON"));
  EXPECT_THAT(failure("\"\xff\""), HasSubstr("invalid JSON"));
}

TEST(JsonSource, RejectsDuplicateKeys) {
  EXPECT_THAT(failure("{\"seed\": 1,\n \"seed\": 2}"), HasSubstr("bad.json:2:2: invalid JSON: duplicate key 'seed'"));
}

TEST(JsonSource, RejectsDeepNesting) { EXPECT_THAT(failure(std::string(100000, '[')), HasSubstr("nested deeper")); }

TEST(JsonSource, DoesNotStoreAPointerForEveryValue) {
  // A table of JSON pointers would take 20 GB.
  std::string text = "{\"" + std::string(200'000, 'k') + "\": [0";
  for (int i = 0; i < 100'000; ++i) text += ",0";
  const JsonSource source = JsonSource::from_text(text + "]}", "long.json");
  const Problem problem = source.problem("/" + std::string(200'000, 'k') + "/99999", "");
  EXPECT_EQ(problem.column, 1 + 2 + 200'000 + 4 + 2 * 99'999);
}

TEST(JsonSource, LocatesManyMistakesWithoutRescanning) {
  // A scan of the text for each mistake would read 10^11 bytes.
  std::string text = "{";
  for (int i = 0; i < 50'000; ++i) text += "\"unknown key number " + std::to_string(i) + "\": 0,\n";
  const JsonSource source = JsonSource::from_text(text + "\"known\": 0}", "many.json");
  std::vector<Problem> problems;
  ObjectReader reader(source, "", problems);
  reader.get("known");
  reader.reject_unknown();
  EXPECT_EQ(problems.size(), 50'000u);
}

TEST(ParsedJson, RejectsInvalidAndDeeplyNestedJson) {
  const auto nested = [](std::size_t deep) { return std::string(deep, '[') + std::string(deep, ']'); };
  EXPECT_EQ(parsed_json("{\"a\": [1]}")["a"][0], 1);
  EXPECT_TRUE(parsed_json("{").is_discarded());
  EXPECT_FALSE(parsed_json(nested(kMaxJsonDepth)).is_discarded());
  EXPECT_TRUE(parsed_json(nested(kMaxJsonDepth + 1)).is_discarded());
  EXPECT_TRUE(parsed_json(nested(11), 10).is_discarded());
  EXPECT_FALSE(parsed_json("\"" + nested(5000) + "\\\"[\"").is_discarded()) << "brackets in a string";
}

TEST(ObjectReader, CollectsEveryMistake) {
  const JsonSource source = JsonSource::from_text(
      R"({"number": "x", "count": 2.5, "list": [1, "2"], "flag": 1, "instence": 3, "$schema": "s"})", "s.json");
  std::vector<Problem> problems;
  ObjectReader reader(source, "", problems);
  EXPECT_EQ(reader.number("number", 7.0, 0, 1), 7.0);
  EXPECT_EQ(reader.integer("count", 4, 0, 10), 4);
  EXPECT_THAT(reader.numbers("list", 2, {8, 9}), ElementsAre(8, 9));
  EXPECT_EQ(reader.boolean("flag", true), true);
  EXPECT_EQ(reader.integer("instances", 100, 1, 1000), 100);
  EXPECT_EQ(reader.required_string("name"), "");
  reader.reject_unknown();
  ASSERT_EQ(problems.size(), 6u);
  EXPECT_EQ(problems[0].to_string(), "s.json:1:12: /number: expected a number from 0 to 1, found \"x\"");
  EXPECT_THAT(problems[4].to_string(), HasSubstr("missing key 'name'"));
  EXPECT_THAT(problems[5].to_string(), HasSubstr("unknown key 'instence'; did you mean 'instances'?"));
}

TEST(ObjectReader, ListsEachAllowedKeyOnce) {
  const JsonSource source = JsonSource::from_text(R"({"other": 1})", "s.json");
  std::vector<Problem> problems;
  ObjectReader reader(source, "", problems);
  reader.number("a", 0, 0, 1);
  reader.get("a");
  reader.get("b");
  reader.reject_unknown();
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_EQ(problems[0].message, "unknown key 'other'; allowed: a, b");
}

TEST(ObjectReader, ChecksRangesAndTypes) {
  const JsonSource source = JsonSource::from_text(R"({"a": 2, "b": 18446744073709551615, "o": [1]})", "s.json");
  std::vector<Problem> problems;
  ObjectReader reader(source, "", problems);
  EXPECT_EQ(reader.number("a", 0, 0, 1), 0);
  EXPECT_EQ(reader.integer("b", -1, 0, 5), -1);
  EXPECT_EQ(problems.size(), 2u);
  ObjectReader list(source, "/o", problems);
  EXPECT_FALSE(list.has("x"));
  EXPECT_EQ(problems.size(), 3u);
  EXPECT_THAT(problems[2].message, HasSubstr("expected an object, found array"));
}

TEST(CanonicalJson, IgnoresOrderAndSpacing) {
  const auto a = JsonSource::from_text(R"({"b": 0.1, "a": [1, 2.50]})", "");
  const auto b = JsonSource::from_text(R"({ "a":[1,2.5],"b":0.10 })", "");
  EXPECT_EQ(canonical_json(a.root()), canonical_json(b.root()));
  EXPECT_EQ(canonical_json(a.root()), R"({"a":[1,2.5],"b":0.1})");
}

TEST(ParsedJson, ReadsWhatTheParserReads) {
  for (const char* text : {"null", "true", "-0.0", "18446744073709551615", "1e-300", "\"x\\u0041\"", "[]", "{}",
                           R"({"a": [1, {"b": [], "c": {"a": 1}}, "x"], "b": {"a": 2}})", " [ [ ] , [ 1 ] ] "}) {
    EXPECT_EQ(parsed_json(text).dump(), Json::parse(text).dump());
    EXPECT_EQ(valid_json(text), Json::parse(text));
  }
  for (const char* text : {"", "{", "[1,]", "{\"a\"}", "1 2", "{} {}", "1e999", "\"\xff\""})
    EXPECT_TRUE(parsed_json(text).is_discarded()) << text;
  EXPECT_TRUE(parsed_json("[[1]]", 1).is_discarded());
  EXPECT_FALSE(parsed_json("[[1]]", 2).is_discarded());
  EXPECT_TRUE(parsed_json(std::string(kMaxJsonDepth + 1, '[')).is_discarded());
}

TEST(ParsedJson, RefusesAKeyThatIsThereTwice) {
  for (const char* text : {R"({"a": 1, "a": 1})", R"({"b": 1, "a": 2, "c": 3, "a": 4})", R"([{"x": {"a": 1, "a": 2}}])",
                           R"({"a": 1, "\u0061": 2})"}) {
    EXPECT_TRUE(parsed_json(text).is_discarded()) << text;
    try {
      valid_json(text);
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      EXPECT_THAT(error.what(), HasSubstr("duplicate key 'a'")) << text;
    }
  }
  try {
    valid_json("{\"step\": 1,\n \"step\": 2}");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "invalid JSON at line 2, column 2: duplicate key 'step'");
  }
}

}  // namespace
}  // namespace relign
