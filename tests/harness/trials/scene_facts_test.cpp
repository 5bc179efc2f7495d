// Reading a scene's description and reporting every mistake in it.
#include "trials/scene_facts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace relign::trials {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

const char* const kGood = R"({
  "name": "lens", "summary": "A lens.",
  "axes": [{"name": "x", "unit": "mm", "lower": -1, "upper": 1},
           {"name": "Rx", "unit": "deg", "lower": -7, "upper": 7}],
  "nominal_pose": [0.5, 0.25],
  "image": {"width": 200, "height": 100, "white": 0.115},
  "elements": ["L1", "L2"], "files": ["/data/lens.json"],
  "machine_time": {"speed_mm_per_s": 2, "settle_ms": 0},
  "spec": {"rmse": 0.02}, "sensor_side_mm": 5})";

TEST(SceneFacts, StationNeedsNoNominalPoseElementsOrGroundTruth) {
  const std::string station = R"({"name": "bench", "owns_stage": true, "truth": false,
    "axes": [{"name": "x", "unit": "mm", "lower": -1, "upper": 1}], "image": {"width": 20, "height": 10}})";
  const SceneFacts facts = read_scene_facts(station, "bench");
  EXPECT_TRUE(facts.owns_stage);
  EXPECT_FALSE(facts.truth);
  EXPECT_THAT(facts.nominal_pose, ElementsAre(0.5));
  EXPECT_FALSE(read_scene_facts(kGood, "lens").owns_stage);
  EXPECT_TRUE(read_scene_facts(kGood, "lens").truth);
  std::string boastful = station;
  boastful.replace(boastful.find("false"), 5, "true");
  EXPECT_THROW(read_scene_facts(boastful, "bench"), Error);
}

TEST(SceneFacts, ReadsEverything) {
  const SceneFacts facts = read_scene_facts(kGood, "lens");
  EXPECT_EQ(facts.name, "lens");
  EXPECT_EQ(facts.summary, "A lens.");
  ASSERT_EQ(facts.axes.size(), 2u);
  EXPECT_EQ(facts.axes[1].name, "Rx");
  EXPECT_EQ(facts.axes[1].unit, "deg");
  EXPECT_EQ(facts.axes[1].travel(), 14);
  EXPECT_THAT(facts.nominal_pose, ElementsAre(0.5, 0.25));
  EXPECT_EQ(facts.image_width, 200u);
  EXPECT_EQ(facts.image_height, 100u);
  EXPECT_EQ(facts.image_white, 0.115);
  EXPECT_THAT(facts.elements, ElementsAre("L1", "L2"));
  EXPECT_THAT(facts.files, ElementsAre("/data/lens.json"));
  EXPECT_EQ(facts.machine_time.speed_mm_per_s, 2);
  EXPECT_EQ(facts.machine_time.settle_ms, 0);
  EXPECT_EQ(facts.machine_time.speed_deg_per_s, 5) << "missing members keep their defaults";
  EXPECT_EQ(facts.spec.at("rmse"), 0.02);
  EXPECT_EQ(facts.text, kGood);
}

std::string refusal(const std::string& description) {
  try {
    read_scene_facts(description, "my-scene");
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::plugin_failed);
    EXPECT_THAT(error.what(), HasSubstr("scene 'my-scene' has an unusable description"));
    return error.what();
  }
  return "no error";
}

// The good description with one part replaced.
std::string with(const std::string& part, const std::string& replacement) {
  std::string text = kGood;
  const auto found = text.find(part);
  EXPECT_NE(found, std::string::npos) << part;
  return text.replace(found, part.size(), replacement);
}

TEST(SceneFacts, ReadingsAreTheLastRowOfACapture) {
  const std::string score = R"("score": {"name": "loss", "resolution": 0.1, "reading": "second"}, "elements":)";
  const auto read = [&](const std::string& readings) {
    return with("\"elements\":", "\"readings\": [" + readings + "], " + score);
  };
  const std::string two = R"({"name": "first"}, {"name": "second"})";
  const SceneFacts both = read_scene_facts(read(two), "lens");
  EXPECT_EQ(both.image_width, 200u);
  EXPECT_EQ(both.image_height, 101u);
  EXPECT_TRUE(both.has_image());
  EXPECT_EQ(both.score_measure, 200u * 100 + 1);
  EXPECT_EQ(both.score_reading(), "second");
  std::string many = two;
  for (int k = 0; k < 199; ++k) many += ", {\"name\": \"r" + std::to_string(k) + "\"}";
  EXPECT_THAT(refusal(read(many)), HasSubstr("at most as many readings as the image has columns, 200; found 201"));

  std::string alone = read(two);
  const std::size_t image = alone.find("\"image\"");
  alone.erase(image, alone.find('}', image) + 2 - image);
  const SceneFacts row = read_scene_facts(alone, "lens");
  EXPECT_EQ(row.image_width, 2u);
  EXPECT_EQ(row.image_height, 1u);
  EXPECT_FALSE(row.has_image());
  EXPECT_EQ(row.score_measure, 1u);
}

TEST(SceneFacts, ReportsEveryMistake) {
  EXPECT_THAT(refusal("no JSON"), HasSubstr("invalid JSON"));
  EXPECT_THAT(refusal("[]"), HasSubstr("expected an object"));
  EXPECT_THAT(refusal("{}"), AllOf(HasSubstr("'name'"), HasSubstr("axes"), HasSubstr("'nominal_pose'"),
                                   HasSubstr("'image'"), HasSubstr("'elements'")))
      << "all at once";
  EXPECT_THAT(refusal(with("\"lens\"", "\"\"")), HasSubstr("expected the name of the scene"));
  EXPECT_THAT(refusal(with("\"Rx\"", "\"x\"")), HasSubstr("duplicate axis 'x'"));
  EXPECT_THAT(refusal(with("\"deg\"", "\"rad\"")), HasSubstr("missing key 'speed_per_s' (in 'rad' per second"));
  EXPECT_THAT(refusal(with("\"deg\"", "\"\"")), HasSubstr("expected 'mm', 'deg' or another unit in one line"));
  EXPECT_EQ(refusal(with("\"deg\"", "\"A\", \"speed_per_s\": 2")), "no error");
  EXPECT_THAT(refusal(with("\"lower\": -7", "\"lower\": 7")), HasSubstr("/axes/1/upper: must be greater"));
  EXPECT_THAT(refusal(with("\"lower\": -7", "\"lowest\": -7")), HasSubstr("did you mean 'lower'"));
  EXPECT_THAT(refusal(with("[0.5, 0.25]", "[0.5]")), HasSubstr("expected a list of 2 numbers"));
  EXPECT_THAT(refusal(with("[0.5, 0.25]", "[0.5, 1.25]")), HasSubstr("from 0 to 1"));
  EXPECT_THAT(refusal(with("\"width\": 200, ", "")), HasSubstr("missing key 'width'"));
  EXPECT_THAT(refusal(with("200", "0")), HasSubstr("/image/width"));
  EXPECT_THAT(refusal(with("0.115", "-1")), HasSubstr("/image/white"));
  EXPECT_THAT(refusal(with("[\"L1\", \"L2\"]", "[\"L1\", \"L1\"]")), HasSubstr("duplicate element 'L1'"));
  const auto uncertain = [](const std::string& list) {
    return with("\"files\":", "\"uncertain\": " + list + ", \"files\":");
  };
  EXPECT_THAT(refusal(uncertain(R"([{"name": "L1", "unit": "um", "law": {}}])")),
              HasSubstr("expected a name that no other quantity and no element has, found 'L1'"));
  EXPECT_THAT(refusal(uncertain(R"([{"name": "waist", "unit": "um"}])")), HasSubstr("missing key 'law'"));
  EXPECT_THAT(refusal(uncertain(R"([{"name": "waist", "unit": "um", "law": {}, "sigma": 1}])")), HasSubstr("'sigma'"));
  EXPECT_THAT(refusal(uncertain("3")), HasSubstr("expected a list of quantities"));
  EXPECT_THAT(refusal(with("[\"L1\", \"L2\"]", "[\"L1\", 2]")), HasSubstr("expected a list of non-empty strings"));
  EXPECT_THAT(refusal(with("[\"/data/lens.json\"]", "\"lens.json\"")),
              HasSubstr("expected a list of non-empty strings"));
  EXPECT_THAT(refusal(with("\"speed_mm_per_s\": 2", "\"speed_mm_per_s\": 0")), HasSubstr("/machine_time/speed"));
  EXPECT_THAT(refusal(with("\"settle_ms\": 0", "\"settle_mss\": 0")), HasSubstr("did you mean 'settle_ms'"));
  EXPECT_THAT(refusal(with("{\"rmse\": 0.02}", "3")), HasSubstr("/spec: expected an object"));
  EXPECT_THAT(refusal(with("{\"rmse\": 0.02}", "{\"rsme\": 0.02}")), HasSubstr("did you mean 'rmse'"));
}

TEST(SceneFacts, LimitsTheNumberOfAxes) {
  std::string axes, pose;
  for (int i = 0; i < 65; ++i) {
    axes += (i ? "," : "") + (R"({"name":"a)" + std::to_string(i)) + R"(","unit":"mm","lower":0,"upper":1})";
    pose += i ? ",0.5" : "0.5";
  }
  EXPECT_THAT(refusal(R"({"name":"s","axes":[)" + axes + R"(],"nominal_pose":[)" + pose +
                      R"(],"image":{"width":1,"height":1},"elements":[]})"),
              HasSubstr("1 to 64 axes"));
}

TEST(SceneFacts, FieldsEndWhereRegionsDo) {
  const images::Region edge{120, 130, 20, 20}, window{60, 60, 140, 140};
  const images::EdgeFields fields = {{"marked", images::Mark{110, 110, 40}, edge, {}},
                                     {"windowed", images::Mark{110, 110, 40}, edge, {}, window},
                                     {"far", images::Mark{600, 400, 40}, images::Region{610, 410, 20, 20}, {}},
                                     {"plain", {}, images::Region{100, 100, 30, 30}, images::Region{500, 100, 30, 30}}};
  images::EdgeFields shown = fields;
  const auto expect_window = [&](std::size_t field, const images::Region& wanted) {
    ASSERT_TRUE(shown[field].window);
    const images::Region& found = *shown[field].window;
    EXPECT_EQ(std::vector<std::size_t>({found.x, found.y, found.width, found.height}),
              std::vector<std::size_t>({wanted.x, wanted.y, wanted.width, wanted.height}))
        << field;
  };
  // The second has more of the mark than the first.
  show_regions({{0, 0, 100, 100}, {95, 50, 200, 200}}, fields, shown);
  expect_window(0, {95, 50, 200, 200});
  expect_window(1, {95, 60, 105, 140});
  expect_window(2, {0, 0, 1, 1});
  EXPECT_FALSE(shown[3].sagittal) << "not read out";
  EXPECT_TRUE(shown[3].tangential) << "in the second region";
  show_regions({{0, 0, 110, 300}}, fields, shown);
  EXPECT_FALSE(shown[3].tangential) << "cut";
  show_regions({{0, 0, 800, 600}}, fields, shown);
  EXPECT_TRUE(shown[3].tangential && shown[3].sagittal) << "nothing remains of other regions";
  expect_window(1, window);
}

}  // namespace
}  // namespace relign::trials
