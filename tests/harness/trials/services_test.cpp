// The services of a trial, in process: their answers, access, cost, and that they reveal nothing of the instance.
// Fake scene: start (0.3, 0.58, 0.5), optimum 0.5 on every axis, O* = 0.5 everywhere.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "base/error.h"
#include "base/files.h"
#include "base/seeds.h"
#include "trials/fakes.h"
#include "trials/measure_table.h"

namespace relign::trials {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

// A trial of a scripted user of services, with everything the host can offer.
struct ServiceTrial : TrialWithServices {
  explicit ServiceTrial(const std::string& script, const std::string& folder = "service_user",
                        const Json& scene_parameters = Json::object())
      : TrialWithServices(folder, {{"script", Json::parse(script)}}, scene_parameters) {}
};

// ---- reference and measures ---------------------------------------------------------------------

TEST(Services, ReferenceIsTheWholeImageWithoutRowGaps) {
  ServiceTrial trial(R"([["reference"], ["step", [0.5, 0.5, 0.5]], ["reference"]])");
  trial.run();
  EXPECT_EQ(trial.answer("reference"), Json({3, 2, 3.0}));
  EXPECT_EQ(trial.answer("reference", 1), Json({3, 2, 3.0})) << "valid for the whole trial";
}

TEST(Services, MeasuresUseTheLastCapture) {
  ServiceTrial trial(R"([["measure", "mean"], ["step", [0.5, 0.58, 0.5]], ["measure", "mean"], ["measure", "contrast"],
                         ["measure", "mtf", {"cycles_per_pixel": 0.1}], ["measure", "centroid_x_px"]])");
  trial.run();
  EXPECT_NEAR(trial.answer("measure").get<double>(), 0.5 + std::sqrt(0.04 + 0.0064), 1e-6);
  EXPECT_NEAR(trial.answer("measure", 1).get<double>(), 0.58, 1e-6);
  EXPECT_NEAR(trial.answer("measure", 2).get<double>(), 0, 1e-6);
  EXPECT_EQ(trial.answer("measure", 3), nullptr) << "an image without an edge is not a failure";
  EXPECT_EQ(trial.answer("measure", 4), nullptr);
}

TEST(Services, FieldsOfASceneWithout) {
  ServiceTrial trial(R"([["fields", {"cycles_per_pixel": 0.1}]])");
  trial.run();
  EXPECT_THAT(trial.answer("refused").get<std::string>(), HasSubstr("'fake' describes no 'fields'"));
}

TEST(Services, MeasuresAreListed) {
  ServiceTrial trial(R"([["list"]])");
  trial.run();
  std::set<std::string> names;
  for (const Json& measure : trial.answer("list")) names.insert(measure.at("name"));
  EXPECT_EQ(names, (std::set<std::string>{"mean", "contrast", "sharpness", "centroid_x_px", "centroid_y_px", "width_px",
                                          "field_mtf", "mark_x_px", "mark_y_px", "star_contrast", "mtf", "shift_x_px",
                                          "shift_y_px", "rotation_deg"}));
}

TEST(Services, ShiftAndRotationAreRelativeToTheReference) {
  // An L of light, and the same two columns to the right and one row up.
  images::Image reference(60, 50), seen(60, 50);
  for (std::size_t y = 10; y < 40; ++y)
    for (std::size_t x = 15; x < (y < 30 ? 25 : 45); ++x) {
      reference.at(x, y) = 0.2F;
      seen.at(x + 2, y - 1) = 0.2F;
    }
  EXPECT_NEAR(measure(seen, reference, {}, "shift_x_px", ""), 2, 0.01);
  EXPECT_NEAR(measure(seen, reference, {}, "shift_y_px", ""), -1, 0.01);
  EXPECT_NEAR(measure(seen, reference, {}, "rotation_deg", "{}"), 0, 0.02);
  EXPECT_TRUE(std::isnan(measure(images::Image(60, 50, 0.2F), reference, {}, "shift_x_px", "")));
}

TEST(Services, RejectsInvalidMeasuresWithMessage) {
  ServiceTrial trial(R"([["measure", "sharpnes"], ["measure", "mtf"], ["measure", "mean", {"radius": 2}],
                         ["measure", "star_contrast", {"cycles": 8}], ["measure", "mtf", {"cycles_per_pixel": 9}],
                         ["measure", "mtf", {"cycles_per_pixel": 0.1, "x": 2, "width": 2}]])");
  EXPECT_EQ(trial.run().end, End::finished);
  EXPECT_THAT(trial.answer("refused").get<std::string>(), HasSubstr("'sharpness'"));
  EXPECT_THAT(trial.answer("refused", 1).get<std::string>(), HasSubstr("cycles_per_pixel"));
  EXPECT_THAT(trial.answer("refused", 2).get<std::string>(), HasSubstr("radius"));
  EXPECT_THAT(trial.answer("refused", 3).get<std::string>(), HasSubstr("'radius_px'"));
  EXPECT_THAT(trial.answer("refused", 4).get<std::string>(), HasSubstr("9"));
  EXPECT_THAT(trial.answer("refused", 5).get<std::string>(), HasSubstr("3 x 2 pixels"));
}

// ---- observes ----------------------------------------------------------------------------------------

TEST(Services, RequireDeclaredObservations) {
  ServiceTrial trial(
      R"([["reference"], ["measure", "mean"], ["draw", 1], ["model", {}, [0.5, 0.5, 0.5], 1], ["run", "then", 1],
          ["history"], ["select", []]])",
      "service_user_ignorant");
  trial.run();
  const char* const words[] = {"\"images\"",    "\"images\"",  "\"level\"", "\"design\"",
                               "\"algorithm\"", "\"history\"", "\"images\""};
  ASSERT_THAT(trial.logged("refused"), SizeIs(7));
  for (std::size_t i = 0; i < 7; ++i) EXPECT_THAT(trial.answer("refused", i).get<std::string>(), HasSubstr(words[i]));
}

TEST(Services, DeclaringImagesGrantsNeitherMeritNorStart) {
  ServiceTrial trial(R"([["step", [0.1, 0, 0]], ["measure", "mean"]])", "service_user_images");
  const TrialResult result = trial.run();
  EXPECT_EQ(trial.answer("step"), Json({{"step", 1}, {"pose", {0.1, 0, 0}}, {"merit", nullptr}, {"image", true}}));
  EXPECT_NEAR(result.steps.at(1).true_pose.at(0), 0.4, 1e-12) << "coordinates are relative to the unknown start";
  EXPECT_THAT(trial.logged("measure"), SizeIs(1));
}

// ---- prior ------------------------------------------------------------------------------------------

TEST(Services, PriorDrawsUseTrainingSeedsAndRepeatInEveryTrial) {
  const std::string script = R"([["draw", 7], ["draw", 8], ["draw", 7]])";
  ServiceTrial trial(script), other(script);
  other.instance.number = 4;
  other.instance.seed = 78;
  other.terms.algorithm_seed = 6;
  trial.run();
  other.run();
  EXPECT_EQ(trial.answer("draw"), trial.answer("draw", 2));
  EXPECT_NE(trial.answer("draw"), trial.answer("draw", 1));
  EXPECT_EQ(trial.answer("draw"), other.answer("draw"));
  const Json drawn = Json::parse(trial.answer("draw").get<std::string>());
  EXPECT_EQ(drawn["elements"], Json::parse(R"({"L1": {"shift_mm": [0.1, 0, 0], "tilt_deg": [0, 0]}})"));
  EXPECT_EQ(drawn["distortion"], Json::parse("[[1, 0, 0], [0, 1, 0], [0, 0, 1]]"));
  EXPECT_EQ(drawn["cure_shift"], Json({0.01, 0.0, 0.0}));
  EXPECT_EQ(drawn["stage"], Json::parse(R"({"backlash": [0.01, 0, 0], "repeatability": [0, 0, 0],
      "encoder_step": [0, 0, 0], "drift": [0, -0.5, 0], "drift_seconds": 60})"));
  const auto start_of = [&](std::uint64_t seed) {
    return Json::parse(trial.level->draw(seed, trial.facts.text)).at("start");
  };
  EXPECT_EQ(drawn["start"], start_of(instance_seed(0, SeedDomain::training, 7)));
  // Neither this instance nor any benchmark instance, for any suite seed.
  EXPECT_NE(drawn["start"], start_of(trial.instance.seed));
  for (std::uint64_t suite_seed = 0; suite_seed < 3; ++suite_seed)
    for (std::uint64_t number = 0; number < 100; ++number)
      EXPECT_NE(drawn["start"], start_of(instance_seed(suite_seed, SeedDomain::benchmark, number)));
}

// ---- history ----------------------------------------------------------------------------------------

TEST(Services, HistoryHasTheEarlierModulesOfTheBatch) {
  const auto run_of = [](std::uint64_t number, const std::string& script) {
    auto trial = std::make_unique<ServiceTrial>(script);
    trial->level = std::make_unique<plugin_host::NoiseLevel>(
        fake(plugin_host::Kind::noise_level, "fake_level", {{"batches", true}}), trial->services);
    trial->instance = draw_instance(*trial->level, trial->facts, 2, SeedDomain::benchmark, number);
    trial->run();
    return trial;
  };
  const auto last = run_of(9, R"([["history"], ["history", 2], ["history", 0], ["history", 5]])");
  const Json shifts = last->answer("history");
  ASSERT_THAT(shifts, SizeIs(4));
  for (std::uint32_t back = 1; back <= 4; ++back)
    EXPECT_EQ(shifts[back - 1], Json(inspected_shift(*last->level, last->facts, last->instance, back)));
  EXPECT_EQ(last->answer("history", 1), shifts[1]);
  EXPECT_THAT(last->answer("refused").get<std::string>(), HasSubstr("found module 0"));
  EXPECT_THAT(last->answer("refused", 1).get<std::string>(), HasSubstr("expected 1 to 4"));
  EXPECT_EQ(run_of(5, R"([["history"]])")->answer("history"), Json::array());
  ServiceTrial without(R"([["history"]])");
  without.run();
  EXPECT_EQ(without.answer("history"), Json::array());
}

TEST(Services, PriorDrawsHaveBatches) {
  ServiceTrial trial(R"([["draw", 5], ["draw", 9], ["draw", 10]])");
  trial.level = std::make_unique<plugin_host::NoiseLevel>(
      fake(plugin_host::Kind::noise_level, "fake_level", {{"batches", true}}), trial.services);
  trial.run();
  std::vector<Json> draws;
  for (std::size_t i = 0; i < 3; ++i) draws.push_back(Json::parse(trial.answer("draw", i).get<std::string>()));
  EXPECT_EQ(draws[0]["cure_shift"], draws[1]["cure_shift"]);
  EXPECT_NE(draws[0]["cure_shift"], draws[2]["cure_shift"]);
  EXPECT_EQ(draws[0]["batch"]["cure_shift"][1], draws[0]["cure_shift"][1]);
  EXPECT_EQ(draws[0]["batch"]["size"], 5);
}

// ---- run ----------------------------------------------------------------------------------------------

TEST(Services, InnerRunUsesExactlyTheOuterBudget) {
  ServiceTrial trial(R"([["step", [0.4, 0.58, 0.5]],
      ["run", "then", 3, {"script": [["first"], ["step", 0.42, 0.58, 0.5], ["step", 0.44, 0.58, 0.5],
                                     ["step", 0.46, 0.58, 0.5], ["step", 0.6, 0.58, 0.5], ["step", 0.6, 0.58, 0.5]]}],
      ["run", "then", 10, {"script": [["move", 0.01, 0, 0], ["move", 0.01, 0, 0], ["move", 0.01, 0, 0]]}],
      ["run", "then", 10], ["step", [0.5, 0.5, 0.5]]])");
  trial.terms.budget = 6;
  const TrialResult result = trial.run();
  EXPECT_EQ(result.end, End::budget_spent);
  ASSERT_THAT(result.steps, SizeIs(7));
  const double x[] = {0.3, 0.4, 0.42, 0.44, 0.46, 0.47, 0.48};
  for (std::size_t k = 0; k < 7; ++k) {
    EXPECT_EQ(result.steps[k].step, k);
    EXPECT_NEAR(result.steps[k].true_pose[0], x[k], 1e-12);
  }
  EXPECT_EQ(trial.answer("run")["steps"], 3);
  EXPECT_EQ(trial.answer("run")["finished"], false);
  EXPECT_EQ(trial.answer("run")["last"]["step"], 4);
  EXPECT_EQ(trial.answer("run")["last"]["pose"], Json({0.46, 0.58, 0.5}));
  EXPECT_EQ(trial.answer("run", 1)["steps"], 2) << "the last steps of the trial";
  EXPECT_EQ(trial.answer("run", 2)["steps"], 0);
  EXPECT_EQ(trial.answer("run", 2)["last"], nullptr);
  EXPECT_EQ(trial.answer("step", 1), nullptr) << "the budget is spent";
  // The inner algorithm's step 0 is the outer algorithm's last step.
  const auto seen = trial.logged("seen");
  ASSERT_THAT(seen, SizeIs(6));
  EXPECT_EQ(seen[0]["step"], 0);
  EXPECT_EQ(seen[0]["pose"], Json({0.4, 0.58, 0.5}));
  EXPECT_EQ(seen[3]["step"], 3);
  EXPECT_EQ(trial.answer("task")["budget"], 3);
  EXPECT_EQ(trial.answer("task", 1)["budget"], 2);
  EXPECT_NE(trial.answer("task")["seed"], trial.answer("task", 1)["seed"]);
  EXPECT_EQ(trial.logged("answer"), (std::vector<Json>{"stop", "stop", "stop"}));
}

TEST(Services, InnerRunMovesTheSameStageWithItsErrors) {
  const auto run = [](const std::string& script) {
    ServiceTrial trial(script);
    trial.instance.perturbations.stage = StageErrors{{0.02, 0, 0}, {0.01, 0.01, 0}, {0, 0, 0}, {0, 0.01, 0}, 1};
    return trial.run().steps;
  };
  const std::vector<Step> nested = run(R"([["step", [0.4, 0.58, 0.5]],
      ["run", "then", 2, {"script": [["step", 0.45, 0.57, 0.5], ["step", 0.42, 0.58, 0.5]]}], ["step", [0.4, 0.6, 0.5]]])");
  const std::vector<Step> direct = run(R"([["step", [0.4, 0.58, 0.5]], ["step", [0.45, 0.57, 0.5]],
      ["step", [0.42, 0.58, 0.5]], ["step", [0.4, 0.6, 0.5]]])");
  ASSERT_THAT(nested, SizeIs(5));
  ASSERT_THAT(direct, SizeIs(5));
  for (std::size_t k = 0; k < 5; ++k) EXPECT_EQ(nested[k].true_pose, direct[k].true_pose) << k;
}

TEST(Services, InnerRunThatReturnsEarlyLeavesTheRestOfTheBudget) {
  ServiceTrial trial(R"([["run", "then", 3, {"script": [["step", 0.5, 0.5, 0.5]]}], ["step", [0.5, 0.6, 0.5]]])");
  const TrialResult result = trial.run();
  EXPECT_THAT(result.steps, SizeIs(3));
  const Json outcome = trial.answer("run");
  EXPECT_EQ(outcome["finished"], true);
  EXPECT_EQ(outcome["steps"], 1);
  EXPECT_EQ(outcome["best"]["step"], 1);
  EXPECT_EQ(outcome["best"]["pose"], Json({0.5, 0.5, 0.5}));
  EXPECT_EQ(result.end, End::finished);
}

TEST(Services, InnerRecommendationCountsOnlyWhenRepeated) {
  const std::string run = R"(["run", "then", 1, {"script": [["recommend", 0.1, 0.2, 0.3], ["step", 0.5, 0.5, 0.5]]}])";
  ServiceTrial trial("[" + run + R"(, ["step", [0.6, 0.5, 0.5]], ["recommend", [0.1, 0.2, 0.3]]])");
  const TrialResult result = trial.run();
  ASSERT_THAT(result.steps, SizeIs(3));
  EXPECT_EQ(result.steps[0].recommendation, "best_measured");
  EXPECT_EQ(result.steps[1].recommendation, "best_measured");
  EXPECT_THAT(result.steps[1].recommended_pose, ElementsAre(0.5, 0.5, 0.5));
  EXPECT_EQ(result.steps[2].recommendation, "own");
  EXPECT_EQ(trial.answer("run")["recommendation"], Json({0.1, 0.2, 0.3}));
}

TEST(Services, InnerRunObservesTheIntersectionInItsOwnCoordinates) {
  ServiceTrial trial(R"([["step", [0.05, 0, 0]],
      ["run", "then", 1, {"script": [["first"], ["recommend", 0.2, 0, 0], ["step", 0.1, 0, 0]]}]])",
                     "service_user_images");
  const TrialResult result = trial.run();
  ASSERT_THAT(result.steps, SizeIs(3));
  EXPECT_EQ(trial.answer("task")["observes"], RELIGN_OBSERVES_IMAGES);
  EXPECT_EQ(trial.answer("task")["box"], nullptr);
  EXPECT_EQ(trial.answer("seen")["pose"], Json({0.0, 0.0, 0.0}));
  EXPECT_EQ(trial.answer("seen")["merit"], nullptr);
  EXPECT_EQ(trial.answer("seen", 1)["pose"], Json({0.1, 0.0, 0.0})) << "as commanded, bit for bit";
  EXPECT_NEAR(result.steps[2].true_pose[0], 0.3 + 0.05 + 0.1, 1e-12);
  const Json outcome = trial.answer("run");
  EXPECT_NEAR(outcome["last"]["pose"][0].get<double>(), 0.15, 1e-12) << "in the outer algorithm's coordinates";
  EXPECT_NEAR(outcome["recommendation"][0].get<double>(), 0.25, 1e-12);
  EXPECT_EQ(outcome["best"], nullptr) << "it would reveal the merit";
}

TEST(Services, ReportsInnerFailureToTheCaller) {
  ServiceTrial trial(R"([["run", "then", 2, {"script": [["step", 0.5, 0.5, 0.5], ["fail"]]}],
                         ["step", [0.6, 0.5, 0.5]]])");
  const TrialResult result = trial.run();
  EXPECT_THAT(trial.answer("refused").get<std::string>(), HasSubstr("out of ideas"));
  EXPECT_EQ(result.end, End::finished);
  EXPECT_THAT(result.steps, SizeIs(3));
}

TEST(Services, RejectsInvalidRuns) {
  ServiceTrial trial(R"([["run", "than", 1], ["run", "then", 0], ["run", "then", 1, {"scrpt": []}]])");
  EXPECT_THAT(trial.run().steps, SizeIs(1));
  EXPECT_THAT(trial.answer("refused").get<std::string>(), HasSubstr("'then'"));
  EXPECT_THAT(trial.answer("refused", 1).get<std::string>(), HasSubstr("at least 1 step"));
  EXPECT_THAT(trial.answer("refused", 2).get<std::string>(), HasSubstr("'script'"));
}

TEST(Services, SceneFailureDuringInnerRunEndsTheTrial) {
  ServiceTrial trial(R"([["run", "then", 3, {"script": [["step", 0.5, 0.5, 0.5], ["step", 0.5, 0.5, 0.6]]}],
                         ["step", [0.6, 0.5, 0.5]]])",
                     "service_user", {{"fail_at", 2}});
  try {
    trial.run();
    FAIL() << "the lamp is out";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("the lamp is out"));
  }
  EXPECT_THAT(trial.logged("refused"), SizeIs(0)) << "the outer algorithm gets a stop, not a failure of the inner one";
}

TEST(Services, EndsInnerRunThatKeepsAsking) {
  ServiceTrial trial(R"([["run", "then", 1, {"script": [["insist", 300000]]}]])");
  const TrialResult result = trial.run();
  EXPECT_EQ(result.end, End::failed);
  EXPECT_THAT(result.message, HasSubstr("100000 requests"));
}

// ---- model ------------------------------------------------------------------------------------------------

TEST(Services, ModelHasTheParametersOfTheManifest) {
  const std::string script = R"([["model", {}, [0.5, 0.5, 0.5], 1], ["model", {}, [0.5, 0.5, 0.6], 1]])";
  ServiceTrial plain(script), tinted(script, "service_user", {{"look", "tinted"}});
  EXPECT_EQ(plain.run().steps.at(0).true_pose, tinted.run().steps.at(0).true_pose);
  EXPECT_EQ(plain.logged("model"), tinted.logged("model")) << "\"model_parameters\" maps tinted to plain";
  EXPECT_EQ(tinted.answer("model")[1], 0.5);
}

TEST(Services, RefusesModelWithOtherElements) {
  ServiceTrial trial(R"([["model", {}, [0.5, 0.5, 0.5], 1]])", "service_user", {{"look", "broken"}});
  trial.run();
  EXPECT_THAT(trial.answer("refused").get<std::string>(),
              HasSubstr("with \"model_parameters\" has another 'elements' in its description"));
}

TEST(Services, ModelIsTheTrialsSceneIfNothingIsReplaced) {
  const plugin_host::Choice plain = fake(plugin_host::Kind::scene, "fake_scene"),
                            noisy = fake(plugin_host::Kind::scene, "fake_scene", {{"look", "tinted"}, {"noise", 0.1}});
  EXPECT_EQ(model_choice(plain).identity, plain.identity);
  EXPECT_EQ(model_choice(noisy).identity,
            fake(plugin_host::Kind::scene, "fake_scene", {{"look", "plain"}, {"noise", 0.1}}).identity);
  plugin_host::Scene scene(plain, {});
  EXPECT_EQ(&ModelScene(scene, plain, {}).get(read_scene_facts(scene.describe(), "plain")), &scene);
}

TEST(Services, ModelIsIndependentOfTheInstance) {
  const std::string script = R"([["model", {}, [0.5, 0.5, 0.5], 1], ["model", {}, [0.5, 0.5, 0.5], 2],
                                 ["model", {"L1": {"shift_mm": [0.1, 0, 0]}}, [0.5, 0.5, 0.5], 1]])";
  const Json noisy = {{"noise", 0.05}};
  ServiceTrial trial(script, "service_user", noisy), other(script, "service_user", noisy);
  other.instance.seed = 78;
  other.instance.perturbations.elements_json = R"({"L1":{"shift_mm":[0.2,0,0],"tilt_deg":[0,0]}})";
  other.instance.perturbations.start = {0.1, 0.2, 0.3};
  const TrialResult result = trial.run();
  other.run();
  ASSERT_THAT(trial.logged("model"), SizeIs(3));
  EXPECT_EQ(trial.logged("model"), other.logged("model")) << "same offsets, pose and seed: same pixels";
  EXPECT_EQ(trial.answer("model")[0], 6);
  const double one = trial.answer("model")[1], two = trial.answer("model", 1)[1], shifted = trial.answer("model", 2)[1];
  EXPECT_NE(one, two) << "the seed makes the noise";
  EXPECT_NEAR(one, 0.525, 0.025);
  EXPECT_NEAR(shifted - one, 0.1, 1e-6);
  EXPECT_EQ(trial.answer("model")[2], nullptr) << "the scene renders no noise-free images";
  EXPECT_THAT(result.steps, SizeIs(1)) << "the model costs no steps";
  // The seeds passed to the scene differ from the frame seeds of this instance.
  const std::vector<std::uint64_t> seeds = trial.seeds("capture");
  EXPECT_EQ(std::set<std::uint64_t>(seeds.begin(), seeds.end()).size(), 3u) << "step 0, seed 1 twice, seed 2";
  EXPECT_EQ(seeds.at(0), frame_seed(trial.instance.seed, 0, FrameStream::capture));
  EXPECT_EQ(seeds.at(1), frame_seed(instance_seed(0, SeedDomain::training, 1), 0, FrameStream::capture));
}

TEST(Services, ModelRejectsUnknownElementsAndPoses) {
  ServiceTrial trial(R"([["model", {"L9": {}}, [0.5, 0.5, 0.5], 1], ["model", {}, [0.5, 0.5], 1],
                         ["model", [], [0.5, 0.5, 0.5], 1]])");
  trial.run();
  EXPECT_THAT(trial.answer("refused").get<std::string>(), HasSubstr("no element 'L9'"));
  EXPECT_THAT(trial.answer("refused", 1).get<std::string>(), HasSubstr("per axis"));
  EXPECT_THAT(trial.answer("refused", 2).get<std::string>(), HasSubstr("object"));
}

TEST(Services, CountsModelTimeAsAlgorithmTime) {
  ServiceTrial trial(R"([["model_nap", 80], ["step", [0.5, 0.5, 0.5]]])");
  const TrialResult result = trial.run();
  ASSERT_THAT(result.steps, SizeIs(2));
  EXPECT_GE(result.steps[1].algorithm_seconds, 0.08);
}

TEST(Services, AllowsALensKeptBeyondTheRun) {
  ServiceTrial trial(R"([["keep_lens"]])");
  EXPECT_EQ(trial.run().end, End::finished);
  EXPECT_THAT(trial.logged("refused"), SizeIs(0));
}

TEST(Services, KeepRoundingModesOfHostAndPluginApart) {
  const std::string measures = R"(["measure", "mean"], ["draw", 3], ["model", {}, [0.41, 0.53, 0.57], 4])";
  ServiceTrial trial("[" + measures + "]");
  ServiceTrial rounding_up(R"([["round_up"], )" + measures + R"(, ["rounding"]])");
  trial.run();
  rounding_up.run();
  for (const char* word : {"measure", "draw", "model"}) EXPECT_EQ(rounding_up.answer(word), trial.answer(word));
  EXPECT_EQ(rounding_up.answer("rounding"), "up");
}

// ---- the document ---------------------------------------------------------------------------------------

// The plugin is compiled from the document's listing.
TEST(Services, DocumentedExampleRuns) {
  ServiceTrial trial("[]");
  const std::string then = (std::filesystem::path(RELIGN_TASK_TEST_PLUGINS) / "fake_optimizer").string();
  const Json inner = {{"use", then}, {"parameters", {{"script", Json::parse(R"([["step", 0.5, 0.5, 0.5]])")}}}};
  trial.algorithm = fake(plugin_host::Kind::optimizer, "services_example", {{"then", inner}});
  const TrialResult result = trial.run();
  EXPECT_EQ(result.message, "");
  ASSERT_THAT(result.steps, SizeIs(2));
  EXPECT_EQ(result.steps[1].recommendation, "own");
  EXPECT_THAT(trial.algorithm_log, testing::Contains("it used 1 steps"));
  EXPECT_THAT(trial.algorithm_log, testing::Contains(HasSubstr("no edge; sharpness")));
}

TEST(Services, DocumentShowsTheManifestAndEveryMeasure) {
  const std::string document = read_file(RELIGN_SERVICES_DOCUMENT);
  EXPECT_THAT(document, HasSubstr(read_file(RELIGN_SERVICES_MANIFEST)));
  for (const Json& measure : list_measures())
    EXPECT_THAT(document, HasSubstr("`" + measure.at("name").get<std::string>() + "`"));
}

}  // namespace
}  // namespace relign::trials
