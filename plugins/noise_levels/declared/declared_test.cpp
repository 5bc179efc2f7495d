#include <gmock/gmock.h>

#include <cmath>

#include "base/error.h"
#include "error_text.h"
#include "plugin_host/objects.h"
#include "plugin_host/test_folder.h"

namespace relign::declared_tests {
namespace {

using plugin_host::Kind;
using testing::AllOf;
using testing::HasSubstr;

const char* const kScene = R"({"name": "coupler", "nominal_pose": [0.5, 0.9],
  "axes": [{"name": "x", "unit": "mm", "lower": -1, "upper": 1}, {"name": "y", "unit": "mm", "lower": -1, "upper": 1}],
  "elements": [],
  "uncertain": [{"name": "waist", "unit": "um", "law": {"law": "normal", "mean": 1, "sigma": 0.5}},
                {"name": "gap", "unit": "um", "law": {"law": "normal", "sigma": 2}},
                {"name": "wedge", "unit": "deg", "law": {"law": "uniform", "lower": 0, "upper": 3}}]})";
constexpr int kDraws = 4000;

class DeclaredTest : public test::FolderTest {
 protected:
  DeclaredTest() { catalog_.add(std::string(RELIGN_PLUGIN_DIR) + "/declared"); }
  plugin_host::NoiseLevel level(const Json& parameters = Json::object()) {
    plugin_host::Choice choice = catalog_.resolve_or_throw(Kind::noise_level, "declared");
    choice.parameters.update(parameters);
    return plugin_host::NoiseLevel(choice, {});
  }
  // A parameter that names a file with this text.
  Json file(const std::string& parameter, const std::string& text) {
    write(parameter, text);
    return {{parameter, (folder_ / parameter).string()}};
  }
  static double value(const Json& draw, const char* name) { return draw["elements"][name]["value"]; }
  std::string refusal(const Json& parameters, const char* scene = kScene) {
    return test::error_text(ErrorKind::plugin_failed, [&] { level(parameters).draw(1, scene); });
  }
  plugin_host::Catalog catalog_;
};

struct Spread {
  double n = 0, sum = 0, squares = 0;
  void add(double value) { ++n, sum += value, squares += value * value; }
  double mean() const { return sum / n; }
  double variance() const { return squares / n - mean() * mean(); }
};

TEST_F(DeclaredTest, FollowsTheDeclaredLaws) {
  plugin_host::NoiseLevel drawn = level();
  Spread waist, gap, wedge;
  for (std::uint64_t seed = 0; seed < kDraws; ++seed) {
    const Json draw = Json::parse(drawn.draw(seed, kScene));
    waist.add(value(draw, "waist"));
    gap.add(value(draw, "gap"));
    wedge.add(value(draw, "wedge"));
    EXPECT_GE(value(draw, "wedge"), 0);
    EXPECT_LE(value(draw, "wedge"), 3);
  }
  const double five = 5 / std::sqrt(kDraws);  // standard errors of a normal value of unit variance
  EXPECT_NEAR(waist.mean(), 1, five * 0.5);
  EXPECT_NEAR(waist.variance(), 0.25, five * 0.25 * std::sqrt(2));
  EXPECT_NEAR(gap.mean(), 0, five * 2);
  EXPECT_NEAR(gap.variance(), 4, five * 4 * std::sqrt(2));
  EXPECT_NEAR(wedge.mean(), 1.5, five * 3 / std::sqrt(12));
  EXPECT_NEAR(wedge.variance(), 0.75, five * 0.75);
}

TEST_F(DeclaredTest, ScalesDeviatesAndStartsNearTheNominalPose) {
  const Json one = Json::parse(level().draw(7, kScene)), none = Json::parse(level({{"scale", 0}}).draw(7, kScene)),
             two = Json::parse(level({{"scale", 2}, {"start", 0.2}}).draw(7, kScene));
  EXPECT_EQ(value(none, "waist"), 1);
  EXPECT_EQ(value(none, "wedge"), 1.5);
  EXPECT_DOUBLE_EQ(value(two, "waist") - 1, 2 * (value(one, "waist") - 1));
  EXPECT_NEAR(two["start"][0].get<double>(), 0.5, 0.1);
  EXPECT_NEAR(two["start"][1].get<double>(), 0.9, 0.1);
  EXPECT_FALSE(one.contains("stage"));
}

TEST_F(DeclaredTest, TakesLawsAndCorrelationsFromAFile) {
  const Json laws =
      file("laws", R"({"quantities": {"gap": {"law": "normal", "sigma": 1}, "waist": {"law": "normal", "sigma": 1}},
                                     "correlations": [{"of": ["waist", "gap"], "value": -0.8}]})");
  plugin_host::NoiseLevel drawn = level(laws);
  Spread product;
  for (std::uint64_t seed = 0; seed < kDraws; ++seed) {
    const Json draw = Json::parse(drawn.draw(seed, kScene));
    product.add(value(draw, "waist") * value(draw, "gap"));
  }
  EXPECT_NEAR(product.mean(), -0.8, 5 * std::sqrt(1 + 0.8 * 0.8) / std::sqrt(kDraws));

  plugin_host::NoiseLevel truncated =
      level(file("laws", R"({"quantities": {"gap": {"law": "normal", "sigma": 2, "lower": -0.5, "upper": 1}}})"));
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const double gap = value(Json::parse(truncated.draw(seed, kScene)), "gap");
    EXPECT_TRUE(gap >= -0.5 && gap <= 1) << gap;
  }
}

TEST_F(DeclaredTest, DrawsWholeRowsOfAFile) {
  plugin_host::NoiseLevel drawn = level(file("draws", "gap,waist\n1,10\n2,20\r\n3,30\n"));
  int counts[4] = {};
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    const Json draw = Json::parse(drawn.draw(seed, kScene));
    EXPECT_EQ(value(draw, "waist"), 10 * value(draw, "gap"));
    ++counts[static_cast<int>(value(draw, "gap"))];
  }
  for (int row = 1; row <= 3; ++row) EXPECT_GT(counts[row], 60);
}

TEST_F(DeclaredTest, StageErrorsAreOfEveryAxis) {
  const Json draw = Json::parse(level({{"backlash", 0.01}, {"drift", 0.02}}).draw(1, kScene));
  EXPECT_EQ(draw["stage"]["backlash"], Json({0.01, 0.01}));
  EXPECT_EQ(draw["stage"]["drift"].size(), 2U);
  EXPECT_EQ(draw["stage"]["drift_seconds"], 60);
}

TEST_F(DeclaredTest, RefusesWhatItCannotDraw) {
  EXPECT_THAT(refusal(file("laws", R"({"quantities": {"weist": {"law": "normal", "sigma": 1}}})")),
              HasSubstr("the file of laws has 'weist', but the scene declares only: waist, gap, wedge"));
  EXPECT_THAT(refusal(file("laws", R"({"quantities": {"gap": {"law": "cauchy"}}})")),
              HasSubstr("expected 'normal' or 'uniform', found 'cauchy'"));
  EXPECT_THAT(refusal(file("laws", R"({"quantities": {"gap": {"law": "normal", "sigma": 1, "lower": 2}}})")),
              HasSubstr("must be from 'lower' to 'upper'"));
  EXPECT_THAT(refusal(file("laws", R"({"correlations": [{"of": ["waist", "wedge"], "value": 0.5}]})")),
              HasSubstr("needs normal laws of both"));
  EXPECT_THAT(refusal(file("laws", R"({"correlations": [{"of": ["waist", "gap"], "value": 1}]})")),
              HasSubstr("not positive definite"));
  EXPECT_THAT(refusal(file("draws", "gap,waist\n1,x\n")), HasSubstr(":2: expected 2 numbers"));
  EXPECT_THAT(refusal(file("draws", "gap,gap\n1,1\n")), HasSubstr(":1: expected different names"));
  EXPECT_THAT(refusal(file("draws", "gap\n")), HasSubstr("expected a row of numbers"));
  EXPECT_THAT(
      refusal(Json::object(), R"({"name": "x", "axes": [{}], "uncertain": [{"name": "a", "law": {"law": "normal"}}]})"),
      AllOf(HasSubstr("/uncertain/0/law"), HasSubstr("sigma")));
}

}  // namespace
}  // namespace relign::declared_tests
