// Instances: draws from a noise level, and every kind of malformed draw.
#include "trials/instance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <relign/random.hpp>

#include "error_text.h"
#include "trials/fakes.h"

namespace relign::trials::instance_tests {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

SceneFacts two_axes() {
  SceneFacts scene;
  scene.name = "lens";
  scene.axes = {{"x", "mm", -1, 1}, {"y", "mm", -1, 1}};
  scene.nominal_pose = {0.5, 0.5};
  scene.elements = {"L1", "L2"};
  return scene;
}

TEST(Perturbations, ReadsDrawOfNoiseLevel) {
  const Perturbations perturbations = read_perturbations(
      R"({"start": [0, 1], "distortion": [[1.5, 0.25], [0, 1]],
          "elements": {"L2": {"tilt_deg": [1, -2]}, "L1": {"shift_mm": [0.1, 0, 3]}}})",
      two_axes(), "level");
  EXPECT_THAT(perturbations.start, ElementsAre(0, 1));
  EXPECT_THAT(perturbations.distortion, ElementsAre(1.5, 0.25, 0, 1));
  EXPECT_EQ(Json::parse(perturbations.elements_json),
            Json::parse(R"({"L1": {"shift_mm": [0.1, 0, 3], "tilt_deg": [0, 0]},
                            "L2": {"shift_mm": [0, 0, 0], "tilt_deg": [1, -2]}})"));
  EXPECT_EQ(perturbations.elements_json, canonical_json(Json::parse(perturbations.elements_json)));
  EXPECT_THAT(perturbations.cure_shift, testing::IsEmpty());
  EXPECT_THAT(read_perturbations(R"({"start": [0, 1], "distortion": [[1, 0], [0, 1]], "elements": {},
                                 "cure_shift": [0.01, -0.02]})",
                                 two_axes(), "level")
                  .cure_shift,
              ElementsAre(0.01, -0.02));
}

TEST(Perturbations, ReadsUncertainQuantitiesBesideTheElements) {
  SceneFacts scene = two_axes();
  scene.uncertain = {{"waist", "um"}, {"gap", "um"}};
  const std::string start = R"({"start": [0, 1], "distortion": [[1, 0], [0, 1]], "elements": )";
  EXPECT_EQ(Json::parse(
                read_perturbations(start + R"({"waist": {"value": -0.25}, "L2": {}}})", scene, "level").elements_json),
            Json::parse(R"({"L2": {"shift_mm": [0, 0, 0], "tilt_deg": [0, 0]}, "waist": {"value": -0.25}})"));
  EXPECT_THAT(test::error_text(ErrorKind::plugin_failed,
                               [&] {
                                 read_perturbations(start + R"({"waist": {"shift_mm": [0, 0, 0]}, "gab": {"value": 1},
                                                                "L1": {"value": 1}}})",
                                                    scene, "level");
                               }),
              AllOf(HasSubstr("/elements/waist"), HasSubstr("missing key 'value'"), HasSubstr("did you mean 'gap'"),
                    HasSubstr("/elements/L1/value")));
}

Perturbations with_stage(const std::string& stage) {
  return read_perturbations(
      R"({"start": [0, 1], "distortion": [[1, 0], [0, 1]], "elements": {}, "stage": )" + stage + "}", two_axes(),
      "my-level");
}

TEST(Perturbations, ReadsErrorsOfTheStage) {
  const Perturbations all = with_stage(R"({"backlash": [0.01, 0], "repeatability": [0, 0.002], "drift": [-0.1, 0],
                                           "encoder_step": [0.001, 0.002], "drift_seconds": 900})");
  ASSERT_TRUE(all.stage);
  EXPECT_THAT(all.stage->backlash, ElementsAre(0.01, 0));
  EXPECT_THAT(all.stage->repeatability, ElementsAre(0, 0.002));
  EXPECT_THAT(all.stage->encoder_step, ElementsAre(0.001, 0.002));
  EXPECT_THAT(all.stage->drift, ElementsAre(-0.1, 0));
  EXPECT_EQ(all.stage->drift_seconds, 900);
  const Perturbations one = with_stage(R"({"backlash": [0.01, 0]})");
  ASSERT_TRUE(one.stage);
  EXPECT_THAT(one.stage->drift, ElementsAre(0, 0));
  // Without an effect there are no errors, and the stage is the linear one.
  EXPECT_FALSE(with_stage("{}").stage);
  EXPECT_FALSE(with_stage(R"({"backlash": [0, 0], "drift": [0, -0.0], "drift_seconds": 5})").stage);
}

std::string refusal(const std::string& drawn) {
  try {
    read_perturbations(drawn, two_axes(), "my-level");
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::plugin_failed);
    EXPECT_THAT(error.what(), HasSubstr("noise level 'my-level' drew unusable perturbations"));
    return error.what();
  }
  return "no error";
}

std::string draw(const std::string& start, const std::string& distortion, const std::string& elements) {
  return R"({"start": )" + start + R"(, "distortion": )" + distortion + R"(, "elements": )" + elements + "}";
}

TEST(Perturbations, RejectsMalformedDraws) {
  const std::string start = "[0.5, 0.5]", identity = "[[1, 0], [0, 1]]";
  ASSERT_EQ(refusal(draw(start, identity, "{}")), "no error");
  EXPECT_THAT(refusal(""), HasSubstr("invalid JSON"));
  EXPECT_THAT(refusal("null"), HasSubstr("expected an object"));
  EXPECT_THAT(refusal("{}"),
              AllOf(HasSubstr("missing key 'start'"), HasSubstr("'distortion'"), HasSubstr("missing key 'elements'")));
  EXPECT_THAT(refusal(draw("[0.5]", identity, "{}")), HasSubstr("/start: expected a list of 2 numbers"));
  EXPECT_THAT(refusal(draw("[0.5, null]", identity, "{}")), HasSubstr("/start: expected a list of 2 numbers"));
  EXPECT_THAT(refusal(draw("[0.5, 1.5]", identity, "{}")), HasSubstr("value 1 is 1.5"));
  EXPECT_THAT(refusal(draw("[NaN, 0.5]", identity, "{}")), HasSubstr("invalid JSON"));
  EXPECT_THAT(refusal(draw("[0.5, 1e999]", identity, "{}")), HasSubstr("invalid JSON"));
  EXPECT_THAT(refusal(draw(start, "[1, 0, 0, 1]", "{}")), HasSubstr("expected 2 rows of 2 numbers"));
  EXPECT_THAT(refusal(draw(start, "[[1, 0], [0]]", "{}")), HasSubstr("expected 2 rows of 2 numbers"));
  EXPECT_THAT(refusal(draw(start, "[[1, 0], [0, \"1\"]]", "{}")), HasSubstr("expected 2 rows of 2 numbers"));
  EXPECT_THAT(refusal(draw(start, "[[1, 0], [0, 1], [0, 0]]", "{}")), HasSubstr("expected 2 rows of 2 numbers"));
  EXPECT_THAT(refusal(draw(start, "[[1, 2], [2, 4]]", "{}")), HasSubstr("the matrix is singular"));
  EXPECT_THAT(refusal(draw(start, "[[0, 0], [0, 0]]", "{}")), HasSubstr("the matrix is singular"));
  EXPECT_THAT(refusal(draw(start, identity, "[]")), HasSubstr("/elements: expected an object"));
  EXPECT_THAT(refusal(draw(start, identity, R"({"L3": {}})")), HasSubstr("no element 'L3'; did you mean 'L1'?"));
  EXPECT_THAT(refusal(draw(start, identity, R"({"L1": 3})")), HasSubstr("/elements/L1: expected an object"));
  EXPECT_THAT(refusal(draw(start, identity, R"({"L1": {"shift_m": [0, 0, 0]}})")),
              HasSubstr("did you mean 'shift_mm'?"));
  EXPECT_THAT(refusal(draw(start, identity, R"({"L1": {"shift_mm": [0, 0]}})")), HasSubstr("a list of 3 numbers"));
  EXPECT_THAT(refusal(draw(start, identity, R"({"L1": {"tilt_deg": [0, 0, 0]}})")), HasSubstr("a list of 2 numbers"));
  EXPECT_THAT(refusal(R"({"start": [0, 0], "distortion": [[1, 0], [0, 1]], "elements": {}, "cure_shift": [1]})"),
              HasSubstr("/cure_shift: expected a list of 2 numbers"));
  EXPECT_THAT(refusal(R"({"start": [0, 0], "distortion": [[1, 0], [0, 1]], "elements": {}, "strat": 1})"),
              HasSubstr("unknown key 'strat'"));
}

TEST(Perturbations, RejectsMalformedErrorsOfTheStage) {
  const auto stage_refusal = [](const std::string& stage) {
    return refusal(R"({"start": [0, 0], "distortion": [[1, 0], [0, 1]], "elements": {}, "stage": )" + stage + "}");
  };
  EXPECT_THAT(stage_refusal("[]"), HasSubstr("/stage: expected an object"));
  EXPECT_THAT(stage_refusal(R"({"backlash": [0.1]})"), HasSubstr("/stage/backlash: expected a list of 2 numbers"));
  EXPECT_THAT(stage_refusal(R"({"backlash": 0.1})"), HasSubstr("/stage/backlash: expected a list of 2 numbers"));
  EXPECT_THAT(stage_refusal(R"({"backlash": [0, -0.1], "repeatability": [2, 0], "encoder_step": [-1e-9, 0]})"),
              AllOf(HasSubstr("/stage/backlash: value 1 is -0.1; expected 0 to 1"),
                    HasSubstr("/stage/repeatability: value 0 is 2"), HasSubstr("/stage/encoder_step: value 0")));
  EXPECT_THAT(stage_refusal(R"({"drift": [-1.5, 0], "drift_seconds": 0})"),
              AllOf(HasSubstr("value 0 is -1.5; expected -1 to 1"), HasSubstr("/stage/drift_seconds")));
  EXPECT_THAT(stage_refusal(R"({"drift": [-0.5, 0]})"), HasSubstr("missing key 'drift_seconds'"));
  EXPECT_THAT(stage_refusal(R"({"backlsh": [0, 0]})"), HasSubstr("did you mean 'backlash'?"));
}

TEST(Perturbations, ReadsBatches) {
  const auto with_batch = [](const std::string& batch) {
    return R"({"start": [0, 0], "distortion": [[1, 0], [0, 1]], "elements": {}, "batch": )" + batch + "}";
  };
  const Perturbations drawn =
      read_perturbations(with_batch(R"({"size": 25, "cure_shift": [0.01, -0.02]})"), two_axes(), "");
  ASSERT_TRUE(drawn.batch);
  EXPECT_EQ(drawn.batch->size, 25u);
  EXPECT_THAT(drawn.batch->cure_shift, ElementsAre(0.01, -0.02));
  EXPECT_THAT(drawn.batch->inspection, ElementsAre(0, 0));
  EXPECT_THAT(drawn.cure_shift, ElementsAre()) << "draw_instance adds the batch's";
  EXPECT_THAT(refusal(with_batch(R"({"inspection": [-0.1, 2], "cure_shift": [1], "mean": 1})")),
              AllOf(HasSubstr("missing key 'size'"), HasSubstr("/batch/inspection: value 0 is -0.1; expected 0 to 1"),
                    HasSubstr("/batch/cure_shift: expected a list of 2 numbers"), HasSubstr("unknown key 'mean'")));
  EXPECT_THAT(refusal(with_batch(R"({"size": 0})")), HasSubstr("/batch/size"));
  EXPECT_THAT(refusal(with_batch(R"({"size": 1001})")), HasSubstr("/batch/size"));
}

class DrawTest : public testing::Test {
 protected:
  DrawTest()
      : facts_(read_scene_facts(plugin_host::Scene(fake(plugin_host::Kind::scene, "fake_scene"), {}).describe(), "s")) {
  }
  SceneFacts facts_;
};

TEST_F(DrawTest, IsAPureFunctionOfSeedDomainAndNumber) {
  plugin_host::NoiseLevel level(fake(plugin_host::Kind::noise_level, "fake_level"), {});
  const Instance one = draw_instance(level, facts_, 9, SeedDomain::benchmark, 4);
  EXPECT_EQ(one.number, 4u);
  EXPECT_EQ(one.seed, instance_seed(9, SeedDomain::benchmark, 4));
  EXPECT_NEAR(one.perturbations.start[0], Random(one.seed).uniform(), 1e-6)
      << "the noise level gets the instance's seed";
  EXPECT_EQ(Json::parse(one.perturbations.elements_json)["L1"]["shift_mm"][0], 0.1);

  draw_instance(level, facts_, 9, SeedDomain::benchmark, 5);
  const Instance again = draw_instance(level, facts_, 9, SeedDomain::benchmark, 4);
  EXPECT_EQ(again.perturbations.start, one.perturbations.start);
  EXPECT_NE(draw_instance(level, facts_, 9, SeedDomain::training, 4).perturbations.start, one.perturbations.start);
  EXPECT_NE(draw_instance(level, facts_, 8, SeedDomain::benchmark, 4).perturbations.start, one.perturbations.start);
}

TEST_F(DrawTest, ModulesOfABatchShareTheMeanCureShift) {
  plugin_host::NoiseLevel level(fake(plugin_host::Kind::noise_level, "fake_level", {{"batches", true}}), {});
  const auto shift = [&](std::uint64_t number, std::uint64_t suite_seed = 9) {
    return draw_instance(level, facts_, suite_seed, SeedDomain::benchmark, number).perturbations.cure_shift;
  };
  // The level draws (0.01, 0, 0) for every module, and (0, random, 0.002) for every batch.
  EXPECT_NEAR(shift(7)[0], 0.01, 1e-15);
  EXPECT_NEAR(shift(7)[2], 0.002, 1e-15);
  for (const std::uint64_t number : {5u, 6u, 8u, 9u}) EXPECT_EQ(shift(number), shift(7)) << number;
  for (const std::uint64_t number : {0u, 4u, 10u, 14u}) EXPECT_NE(shift(number)[1], shift(7)[1]) << number;
  EXPECT_NE(shift(7, 8)[1], shift(7)[1]);
  EXPECT_NE(draw_instance(level, facts_, 9, SeedDomain::training, 7).perturbations.cure_shift, shift(7));
  const std::uint64_t seed = batch_seed(9, SeedDomain::benchmark, 1);
  EXPECT_EQ(shift(7)[1], read_perturbations(level.draw(seed, facts_.text), facts_, "").batch->cure_shift[1]);
}

TEST_F(DrawTest, InspectionMeasuresEarlierModulesWithItsStandardDeviation) {
  plugin_host::NoiseLevel level(fake(plugin_host::Kind::noise_level, "fake_level", {{"batches", true}}), {});
  double sum = 0, squares = 0;
  unsigned count = 0;
  for (std::uint64_t batch = 0; batch < 500; ++batch) {
    const Instance last = draw_instance(level, facts_, 9, SeedDomain::benchmark, 5 * batch + 4);
    ASSERT_EQ(earlier_modules(last), 4u);
    for (std::uint32_t back = 1; back <= 4; ++back, ++count) {
      const std::vector<double> measured = inspected_shift(level, facts_, last, back);
      EXPECT_NEAR(measured[0], 0.01, 1e-15);
      const double error = (measured[1] - last.perturbations.cure_shift[1]) / 0.001;
      sum += error, squares += error * error;
    }
  }
  EXPECT_NEAR(sum, 0, 5 * std::sqrt(count));
  EXPECT_NEAR(squares, count, 5 * std::sqrt(2.0 * count));
}

TEST_F(DrawTest, InspectionOfAModuleIsTheSameForAllLaterModules) {
  plugin_host::NoiseLevel level(fake(plugin_host::Kind::noise_level, "fake_level", {{"batches", true}}), {});
  const auto instance = [&](std::uint64_t number) {
    return draw_instance(level, facts_, 9, SeedDomain::benchmark, number);
  };
  EXPECT_EQ(earlier_modules(instance(5)), 0u);
  EXPECT_THROW(inspected_shift(level, facts_, instance(5), 1), Error) << "another batch";
  EXPECT_THROW(inspected_shift(level, facts_, instance(6), 0), Error) << "itself";
  const std::vector<double> of_five = inspected_shift(level, facts_, instance(9), 4);
  for (const std::uint64_t later : {6u, 7u, 8u})
    EXPECT_EQ(inspected_shift(level, facts_, instance(later), static_cast<std::uint32_t>(later - 5)), of_five);
  EXPECT_NE(inspected_shift(level, facts_, instance(9), 3), of_five);
  plugin_host::NoiseLevel without(fake(plugin_host::Kind::noise_level, "fake_level"), {});
  EXPECT_EQ(earlier_modules(draw_instance(without, facts_, 9, SeedDomain::benchmark, 9)), 0u);
}

TEST_F(DrawTest, RejectsBatchesOfDifferentSizes) {
  const Json malformed = {{"batches", true}, {"malformed", true}};
  plugin_host::NoiseLevel level(fake(plugin_host::Kind::noise_level, "fake_level", malformed), {});
  EXPECT_THROW(draw_instance(level, facts_, 9, SeedDomain::benchmark, 0), Error);
}

TEST_F(DrawTest, ReportsUnusableDrawAsPluginFailure) {
  plugin_host::NoiseLevel level(fake(plugin_host::Kind::noise_level, "fake_level", {{"malformed", true}}), {});
  try {
    draw_instance(level, facts_, 9, SeedDomain::benchmark, 0);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::plugin_failed);
    EXPECT_THAT(error.what(), HasSubstr("value 1 is 2"));
  }
}

}  // namespace
}  // namespace relign::trials::instance_tests
