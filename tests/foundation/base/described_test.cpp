#include "base/described.h"

#include <gmock/gmock.h>

#include <cmath>

#include "error_text.h"

namespace relign {
namespace {

using test::error_text;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

struct Axis {
  std::string name, unit = "mm";
  double travel = 1;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"name"}, s.name...);
    visit(Member{.key = "unit", .one_of = "mm deg"}, s.unit...);
    visit(Member{.key = "travel", .flags = kAboveLeast, .least = 0, .most = 10}, s.travel...);
  }
};

struct Stage {
  unsigned axes = 0;
  std::optional<double> speed;
  double backlash = std::numeric_limits<double>::quiet_NaN();
  std::vector<Axis> list;
  std::map<std::string, bool> flags;
  std::array<std::string, 2> ends;
  Json more;
  bool hard = false;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{.key = "axes", .least = 1, .most = 6}, s.axes...);
    visit(Member{"speed", "", kLeftOut}, s.speed...);
    visit(Member{"backlash", "", kMayBeNull}, s.backlash...);
    visit(Member{"list"}, s.list...);
    visit(Member{"flags", "", kMayLack}, s.flags...);
    visit(Member{"ends"}, s.ends...);
    visit(Member{"more", "", kAnyObject | kMayBeNull}, s.more...);
    visit(Member{"hard"}, s.hard...);
  }
};

const char* const kStage = R"({"axes": 2, "backlash": null, "ends": ["low", "high"], "flags": {"soft": true},
                               "hard": false, "list": [{"name": "x", "unit": "deg", "travel": 2.5}], "more": null})";

TEST(DescribedStruct, IsWrittenAsItWasRead) {
  const Json json = Json::parse(kStage);
  const auto stage = read_described<Stage>(json, "stage.json");
  EXPECT_EQ(stage.axes, 2U);
  EXPECT_FALSE(stage.speed);
  EXPECT_TRUE(std::isnan(stage.backlash));
  ASSERT_EQ(stage.list.size(), 1U);
  EXPECT_EQ(stage.list[0].unit, "deg");
  EXPECT_EQ(json_of(stage), json);
}

TEST(DescribedStruct, MembersThatAreLeftOutOrMayLack) {
  Json json = Json::parse(kStage);
  json.erase("flags");
  json["speed"] = 3;
  const auto stage = read_described<Stage>(json, "stage.json");
  EXPECT_EQ(stage.speed, 3);
  EXPECT_EQ(json_of(stage)["flags"], Json::object());
  EXPECT_EQ(json_of(stage)["speed"], 3);
}

TEST(DescribedStruct, EveryFlawIsNamedWithItsPlace) {
  const Json json = Json::parse(R"({"axes": 7, "speed": "fast", "backlash": [], "list": [{"name": 3, "unit": "m",
    "travel": 0}, 4], "flags": {"soft": 1}, "ends": ["low"], "more": [], "humidity": 1})");
  EXPECT_EQ(error_text(ErrorKind::bad_input, [&] { read_described<Stage>(json, "stage.json"); }),
            R"(stage.json is damaged: /axes is 7; expected an integer from 1 to 6
  /speed is "fast"; expected a number
  /backlash is []; expected a number
  /list/0/name is 3; expected text
  /list/0/unit is "m"; expected 'mm' or 'deg'
  /list/0/travel is 0; expected a number above 0 and at most 10
  /list/1 is 4; expected an object
  /flags/soft is 1; expected true or false
  /ends is ["low"]; expected a list of 2
  /more is []; expected an object
  it lacks 'hard'
  it has the unknown member 'humidity')");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_described<Stage>(5, "stage.json"); }),
              HasSubstr("it is 5; expected an object"));
}

TEST(DescribedStruct, CountsHaveNoSignAndNoFraction) {
  for (const Json& wrong : {Json(-1), Json(1.0), Json("1"), Json(), Json(true), Json(1e30)}) {
    Json json = Json::parse(kStage);
    json["axes"] = wrong;
    EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_described<Stage>(json, "s"); }), HasSubstr("/axes is "))
        << wrong;
  }
}

TEST(DescribedStruct, ListsTheFirstFlawsOnly) {
  Json json = Json::parse(kStage);
  for (std::size_t i = 0; i < 2 * JsonFlaws::kMost; ++i) json["list"].push_back(i);
  const std::string text = error_text(ErrorKind::bad_input, [&] { read_described<Stage>(json, "s"); });
  EXPECT_THAT(text, HasSubstr("/list/" + std::to_string(JsonFlaws::kMost) + " "));
  EXPECT_THAT(text, Not(HasSubstr("/list/" + std::to_string(JsonFlaws::kMost + 1) + " ")));
}

TEST(DescribedStruct, TellsWhichMembersDiffer) {
  const auto a = read_described<Stage>(Json::parse(kStage), "s");
  Stage b = a;
  b.list[0].travel = 3;
  b.axes = 3;
  b.hard = true;
  EXPECT_THAT(
      differing(a, b, {"axes", "list", "ends"}, "one", "two"),
      ElementsAre(
          "axes: 2 in one, 3 in two",
          R"(list: [{"name":"x","travel":2.5,"unit":"deg"}] in one, [{"name":"x","travel":3.0,"unit":"deg"}] in two)"));
  EXPECT_EQ(first_differing(a, b, {"ends", "hard", "list"}), "list") << "in the order of the declaration";
  EXPECT_EQ(first_differing(a, b, {"ends"}), "");
}

}  // namespace
}  // namespace relign
