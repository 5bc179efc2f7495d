// Regions that an algorithm selects for its next capture, in process. Fake scene: start (0.3, 0.58, 0.5), optimum 0.5
// on every axis, O* = 0.5 everywhere, 3 x 2 pixels.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "trials/fakes.h"

namespace relign::trials {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

struct RegionTrial : TrialWithServices {
  explicit RegionTrial(const std::string& script, const Json& scene_parameters = {{"regions", true}})
      : TrialWithServices("service_user", {{"script", Json::parse(script)}}, scene_parameters) {}
};

constexpr double kReadout = 0.03, kExposure = 0.015;  // seconds, the defaults of machine time

TEST(Regions, AreWhatTheNextCaptureReadsOut) {
  RegionTrial trial(R"([["select", [[1, 0, 2, 1], [0, 1, 1, 1]]], ["step", [0.5, 0.58, 0.5]], ["measure", "mean"],
                         ["step", [0.5, 0.58, 0.5]], ["measure", "mean"]])");
  std::vector<std::vector<float>> images;
  trial.callbacks.on_step = [&](const Step&, const float* pixels) { images.emplace_back(pixels, pixels + 6); };
  const TrialResult result = trial.run();
  EXPECT_EQ(trial.answer("select"), Json(true));
  ASSERT_THAT(result.steps, SizeIs(3));
  EXPECT_THAT(images.at(1), ElementsAre(0, images[2][1], images[2][2], images[2][3], 0, 0));
  EXPECT_NEAR(trial.answer("measure").get<double>(), 0.58 / 2, 1e-6);
  EXPECT_NEAR(trial.answer("measure", 1).get<double>(), 0.58, 1e-6) << "a whole frame again";
  EXPECT_EQ(result.steps[1].regions, (PixelRegions{{1, 0, 2, 1}, {0, 1, 1, 1}}));
  EXPECT_TRUE(result.steps[2].regions.empty());
  EXPECT_TRUE(std::isnan(result.steps[1].measured));
  EXPECT_NEAR(result.steps[1].merit, 0.08, 1e-6) << "of the regions";
  EXPECT_NEAR(result.steps[2].measured, 0.08, 1e-6);
  // No move and no settling between steps 1 and 2 but their own: whole - half = half of the readout.
  const double settle = 0.04;
  EXPECT_NEAR(result.steps[2].machine_seconds - result.steps[1].machine_seconds, settle + kExposure + kReadout, 1e-12);
  RegionTrial whole(R"([["step", [0.5, 0.58, 0.5]]])");
  EXPECT_NEAR(whole.run().steps[1].machine_seconds - result.steps[1].machine_seconds, kReadout / 2, 1e-12);
}

TEST(Regions, NeverCountAsTheBestMeasured) {
  RegionTrial trial(R"([["select", [[0, 0, 1, 1]]], ["step", [0.5, 0.5, 0.5]], ["step", [0.5, 0.58, 0.5]]])");
  const TrialResult result = trial.run();
  EXPECT_NEAR(result.steps[1].merit, 0, 1e-6);
  EXPECT_THAT(result.steps[1].recommended_pose, ElementsAre(0.3, 0.58, 0.5)) << "the start's";
  EXPECT_THAT(result.steps[2].recommended_pose, ElementsAre(0.5, 0.58, 0.5));
}

TEST(Regions, OfTheCallerAreNotThoseOfAnInnerAlgorithm) {
  RegionTrial trial(R"([["select", [[0, 0, 1, 1]]], ["run", "then", 1, {"script": [["step", 0.5, 0.58, 0.5]]}],
                         ["step", [0.5, 0.5, 0.5]]])");
  for (const Step& step : trial.run().steps) EXPECT_TRUE(step.regions.empty()) << step.step;
}

TEST(Regions, OfAnInnerAlgorithmAreNotTheBestOfItsRun) {
  RegionTrial trial(R"([["run", "then", 2, {"script": [["select", [[0, 0, 1, 1]]], ["step", [0.5, 0.5, 0.5]],
                                                        ["step", [0.5, 0.58, 0.5]]]}]])");
  trial.algorithm = fake(plugin_host::Kind::optimizer, "service_user",
                         {{"script", trial.algorithm.parameters.at("script")},
                          {"then", std::string(RELIGN_TASK_TEST_PLUGINS) + "/service_user"}});
  trial.run();
  EXPECT_EQ(trial.answer("run").at("steps"), 2);
  EXPECT_EQ(trial.answer("run").at("best").at("step"), 2);
}

TEST(Regions, AreNotSelectedWhereTheSceneCapturesWholeFrames) {
  RegionTrial trial(R"([["select", [[0, 0, 1, 1]]], ["select", []], ["step", [0.5, 0.58, 0.5]]])", Json::object());
  const TrialResult result = trial.run();
  EXPECT_EQ(trial.answer("select"), Json(false));
  EXPECT_EQ(trial.answer("select", 1), Json(false));
  EXPECT_TRUE(result.steps[1].regions.empty());
  EXPECT_NEAR(result.steps[1].measured, 0.08, 1e-6);
}

TEST(Regions, MustBeInsideTheImage) {
  RegionTrial trial(R"([["select", [[1, 0, 3, 1]]], ["select", [[0, 0, 1, 0]]], ["select", [[0, 4294967295, 1, 2]]],
                         ["step", [0.5, 0.58, 0.5]]])");
  const TrialResult result = trial.run();
  ASSERT_THAT(trial.logged("refused"), SizeIs(3));
  EXPECT_THAT(trial.answer("refused").get<std::string>(),
              HasSubstr("found the region [1,0,3,1] (column, row, columns, rows); expected pixels of the image, which "
                        "has 3 columns and 2 rows"));
  EXPECT_THAT(trial.answer("refused", 1).get<std::string>(), HasSubstr("at least one pixel"));
  EXPECT_THAT(trial.answer("refused", 2).get<std::string>(), HasSubstr("2 rows"));
  EXPECT_TRUE(result.steps[1].regions.empty());
}

}  // namespace
}  // namespace relign::trials
