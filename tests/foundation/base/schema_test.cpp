#include "base/schema.h"

#include <gmock/gmock.h>

#include "base/error.h"

namespace relign {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kRules = R"({
  "type": "object",
  "required": ["name", "size"],
  "properties": {
    "name": {"type": "string", "minLength": 1, "maxLength": 4},
    "size": {"type": "number", "minimum": 2, "maximum": 9},
    "count": {"type": "integer", "minimum": 0, "default": 7},
    "kind": {"enum": ["round", "square"], "default": "round"},
    "range": {"oneOf": [{"type": "number", "exclusiveMinimum": 0},
                        {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}]},
    "parts": {"type": "array", "items": {"$ref": "#/definitions/part"}, "minItems": 1, "maxItems": 3},
    "names": {"type": "array", "items": {"type": "string"}, "uniqueItems": true},
    "by_name": {"type": "object", "additionalProperties": {"$ref": "#/definitions/part"}},
    "radius": {"type": ["number", "null"]},
    "own": {"type": "number", "$comment": "checked elsewhere"}
  },
  "additionalProperties": false,
  "definitions": {
    "part": {"type": "object", "required": ["at"], "additionalProperties": false,
             "properties": {"at": {"type": "integer", "minimum": 3}, "on": {"type": "boolean", "default": true}}}
  }
})";

struct Reading {
  Json value;
  std::vector<std::string> problems;
};

Reading read(const std::string& text) {
  const Schema schema(reinterpret_cast<const unsigned char*>(kRules), std::char_traits<char>::length(kRules));
  std::vector<Problem> problems;
  Reading reading;
  reading.value = schema.checked(JsonSource::from_text(text, "f.json"), problems);
  for (const Problem& problem : problems) reading.problems.push_back(problem.to_string());
  return reading;
}

std::vector<std::string> problems_with(const std::string& members) {
  return read(R"({"name": "a", "size": 3, )" + members + "}").problems;
}

TEST(Schema, FillsInDefaults) {
  const Reading reading = read(
      R"({"$schema": "x", "name": "a", "size": 3, "parts": [{"at": 3}], "by_name": {"b": {"at": 4, "on": false}}})");
  EXPECT_THAT(reading.problems, IsEmpty());
  EXPECT_EQ(reading.value, valid_json(R"({"name": "a", "size": 3, "count": 7, "kind": "round",
    "parts": [{"at": 3, "on": true}], "by_name": {"b": {"at": 4, "on": false}}})"));
}

TEST(Schema, ReportsEveryMistakeWithItsPlace) {
  EXPECT_THAT(read("{\"counts\": \"a\",\n \"size\": 10}").problems,
              ElementsAre("f.json:1:1: missing key 'name' (a text of 1 to 4 characters)",
                          "f.json:1:12: /counts: unknown key 'counts'; did you mean 'count'?",
                          "f.json:2:10: /size: expected a number from 2 to 9, found 10"));
  EXPECT_THAT(read("[]").problems, ElementsAre(HasSubstr("expected an object, found []")));
}

TEST(Schema, SaysWhatIsAllowed) {
  EXPECT_THAT(problems_with(R"("count": 1.5)"),
              ElementsAre(HasSubstr("/count: expected an integer of at least 0, found 1.5")));
  EXPECT_THAT(problems_with(R"("count": 18446744073709551615)"),
              ElementsAre(HasSubstr("expected an integer of at least 0")));
  EXPECT_THAT(problems_with(R"("kind": "squares")"),
              ElementsAre(HasSubstr("found 'squares'; allowed: round, square; did you mean 'square'?")));
  EXPECT_THAT(problems_with(R"("range": "x")"),
              ElementsAre(HasSubstr("/range: expected a number above 0 or a list of 2 numbers, found \"x\"")));
  EXPECT_THAT(problems_with(R"("range": 0)"), ElementsAre(HasSubstr("/range: expected a number above 0")));
  EXPECT_THAT(problems_with(R"("range": [1, "2"])"),
              ElementsAre(HasSubstr("/range/1: expected a number, found \"2\"")));
  EXPECT_THAT(problems_with(R"("parts": [])"),
              ElementsAre(HasSubstr("/parts: expected a list of 1 to 3 objects, found []")));
  EXPECT_THAT(problems_with(R"("parts": [{"at": 2}])"),
              ElementsAre(HasSubstr("/parts/0/at: expected an integer of at least 3")));
  EXPECT_THAT(problems_with(R"("names": ["a", "b", "a"])"), ElementsAre(HasSubstr("/names/2: \"a\" is listed twice")));
  EXPECT_THAT(problems_with(R"("by_name": {"x/y": 1})"),
              ElementsAre(HasSubstr("/by_name/x~1y: expected an object, found 1")));
  EXPECT_THAT(problems_with(R"("radius": true)"),
              ElementsAre(HasSubstr("/radius: expected one of these types: number, null")));
  EXPECT_THAT(problems_with(R"("radius": null)"), IsEmpty());
}

TEST(Schema, LeavesWhatCodeChecksAsItIs) { EXPECT_THAT(problems_with(R"("own": "anything")"), IsEmpty()); }

// Readers continue after a mistake, to report others.
TEST(Schema, ReplacesWhatIsWrongByAllowedValues) {
  const Reading reading = read(R"({"name": 3, "count": -1, "parts": "x", "range": "x", "by_name": {"b": {}}})");
  EXPECT_EQ(reading.problems.size(), 6U);
  EXPECT_EQ(reading.value, valid_json(R"({"name": "", "size": 2.0, "count": 7, "kind": "round", "range": 1e-9,
    "parts": [{"at": 3, "on": true}], "by_name": {"b": {"at": 3, "on": true}}})"));
}

}  // namespace
}  // namespace relign
