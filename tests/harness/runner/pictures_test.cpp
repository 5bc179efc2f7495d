#include "runner/pictures.h"

#include <algorithm>
#include <cmath>

#include "base/seeds.h"
#include "images/image_file.h"
#include "runner/trial_runner.h"
#include "toy_suites.h"

namespace relign::runner {
namespace {

using PicturesTest = ToyTest;

TEST_F(PicturesTest, ShowBestMedianAndWorstTrials) {
  run(prepared(suite_text(kWalkers)), options("a"));
  const Json index = Json::parse(read_file(folder_ / "a/pictures/index.json"));
  EXPECT_EQ(index["format"], 1);
  EXPECT_EQ(index["references"], Json::parse(R"([{"scene": "toy-scene", "file": "toy-scene/reference.png"}])"));
  EXPECT_TRUE(fs::exists(folder_ / "a/pictures/toy-scene/reference.png"));
  // Two levels, three algorithms; the stumbler has successful trials at both.
  ASSERT_EQ(index["trials"].size(), 18U);

  std::vector<std::pair<double, std::string>> walkers;
  for (const records::TrialRecord& record : records::read_trials(folder_ / "a"))
    if (record.algorithm == "toy-walker" && record.noise_level == "toy-wild")
      walkers.emplace_back(record.steps.back().recommended_mse, record.trial);
  std::sort(walkers.begin(), walkers.end());
  ASSERT_EQ(walkers.size(), 6U);
  std::map<std::string, std::string> shown;
  for (const Json& trial : index["trials"])
    if (trial["algorithm"] == "toy-walker" && trial["noise_level"] == "toy-wild") shown[trial["why"]] = trial["trial"];
  EXPECT_EQ(shown["best"], walkers[0].second);
  EXPECT_EQ(shown["median"], walkers[2].second);
  EXPECT_EQ(shown["worst"], walkers[5].second);
  for (const Json& trial : index["trials"]) {
    EXPECT_EQ(trial["frames"].size(), 2U);
    for (const Json& frame : trial["frames"])
      EXPECT_TRUE(fs::exists(folder_ / "a/pictures" / frame["file"].get<std::string>())) << frame;
  }
}

// The first frame is the capture of step 0; the last one is at the recommended pose.
TEST_F(PicturesTest, MatchTheFramesOfTheTrial) {
  const PreparedPlan plan = prepared(suite_text("\"toy-walker\""));
  run(plan, options("a"));
  const Json index = Json::parse(read_file(folder_ / "a/pictures/index.json"));
  const std::string id = index["trials"][0]["trial"];
  const auto planned = std::find_if(plan.plan.trials.begin(), plan.plan.trials.end(),
                                    [&id](const suites::PlannedTrial& trial) { return trial.id == id; });
  ASSERT_NE(planned, plan.plan.trials.end());
  const TrialJob job = make_job(plan, *planned);
  TrialRunner runner({1, {}, {}});
  std::vector<float> first;
  const TrialOutcome outcome = runner.run(job, nullptr, [&first](const trials::Step& step, const float* pixels) {
    if (step.step == 0) first.assign(pixels, pixels + 12 * 8);
  });
  const records::StepRecord& last = outcome.record.steps.back();
  std::vector<float> final_frame(12 * 8);
  runner.place(job).assembly->capture(last.recommended_true_pose,
                                      frame_seed(outcome.record.instance_seed, last.step, FrameStream::capture),
                                      final_frame.data());
  const auto expect_equal = [this](const std::string& file, const std::vector<float>& wanted) {
    const images::Image image = images::read_image(folder_ / "a/pictures" / file);
    ASSERT_EQ(image.values.size(), wanted.size());
    EXPECT_EQ(image.width, 12U);
    for (std::size_t pixel = 0; pixel < wanted.size(); ++pixel)
      ASSERT_NEAR(image.values[pixel], std::clamp(wanted[pixel], 0.0F, 1.0F), 0.6 / 255) << pixel;
  };
  expect_equal(id + "/step-000.png", first);
  expect_equal(id + "/step-005.png", final_frame);
}

TEST_F(PicturesTest, FilmShowsFirstToLastCapture) {
  const PreparedPlan plan = prepared(R"({"scenes": ["toy-scene"], "noise_levels": ["toy-level"], "instances": 1,
                                         "steps": 40, "algorithms": ["toy-walker"]})");
  run(plan, options("a"));
  const records::TrialRecord record = records::read_trials(folder_ / "a").front();
  const Json index = Json::parse(read_file(folder_ / "a/pictures/index.json"));
  const Json& film = index["trials"][0]["film"];
  ASSERT_TRUE(film.is_object());
  std::vector<unsigned> steps;
  for (const Json& frame : film["frames"]) {
    steps.push_back(frame["step"]);
    EXPECT_EQ(frame["true_pose"], Json(record.steps[steps.back()].true_pose));
    EXPECT_EQ(frame["measured"], Json(record.steps[steps.back()].measured));
  }
  EXPECT_THAT(steps, testing::ElementsAre(0, 1, 2, 4, 7, 13, 23, 40));
  const images::Image picture = images::read_image(folder_ / "a/pictures" / film["file"].get<std::string>());
  EXPECT_EQ(picture.height, film["tile"]);
  EXPECT_EQ(picture.width, 8 * picture.height);
}

TEST_F(PicturesTest, KeepExistingFiles) {
  const PreparedPlan plan = prepared(suite_text("\"toy-walker\""));
  run(plan, options("a"));
  const Json index = Json::parse(read_file(folder_ / "a/pictures/index.json"));
  const fs::path frame = folder_ / "a/pictures" / index["trials"][0]["frames"][0]["file"].get<std::string>();
  const auto written = fs::last_write_time(frame);
  fs::create_directories(folder_ / "a/pictures/0123456789abcdef");  // of a trial that is no longer shown
  run(plan, options("a"));
  EXPECT_EQ(fs::last_write_time(frame), written);
  EXPECT_FALSE(fs::exists(folder_ / "a/pictures/0123456789abcdef"));
}

// A JSON file of a scene's folder; null if it does not exist.
Json scene_json(const fs::path& results, const std::string& name) {
  for (const auto& entry : fs::directory_iterator(results / "scenes"))
    if (fs::exists(entry.path() / name)) return Json::parse(read_file(entry.path() / name));
  return nullptr;
}

TEST_F(PicturesTest, WritesLandscapeOfThePerfectLens) {
  const PreparedPlan plan = prepared(suite_text("\"toy-walker\""));
  run(plan, options("a"));
  const Json landscape = scene_json(folder_ / "a", "landscape.json");
  ASSERT_TRUE(landscape.is_object());
  EXPECT_EQ(landscape["format"], 1);
  EXPECT_EQ(landscape["pose"], Json({0.5, 0.5}));
  ASSERT_EQ(landscape["lines"].size(), 2U);
  const Json &shares = landscape["lines"][1]["shares"], &mse = landscape["lines"][1]["mse"];
  EXPECT_EQ(landscape["lines"][1]["axis"], "y");
  EXPECT_EQ(shares.front(), 0.0);
  EXPECT_EQ(shares.back(), 1.0);
  ASSERT_EQ(shares.size(), mse.size());
  const std::size_t middle = shares.size() / 2;
  EXPECT_EQ(shares[middle], 0.5);
  EXPECT_NEAR(mse[middle].get<double>(), 0, 1e-8);
  // The scene's own value, independent of algorithms and noise levels.
  TrialRunner runner({1, {}, {}});
  const TrialJob job = make_job(plan, plan.plan.trials.front());
  plugin_host::MountedAssembly lens = runner.scene(job).mount("{}");
  EXPECT_NEAR(mse.front().get<double>(), lens.noise_free_mse({0.5, 0.0}, 1).mse, 1e-7);
  EXPECT_GT(mse.front().get<double>(), 1e-3);
  const Json& plane = landscape["plane"];
  EXPECT_EQ(plane["across"], "x");
  EXPECT_EQ(plane["up"], "y");
  ASSERT_EQ(plane["mse"].size(), plane["across_shares"].size() * plane["up_shares"].size());
  const std::size_t right_end = plane["across_shares"].size() - 1;  // in the lowest row
  EXPECT_NEAR(plane["mse"][right_end].get<double>(),
              lens.noise_free_mse({plane["across_shares"].back(), plane["up_shares"].front()}, 1).mse, 1e-7);
}

TEST_F(PicturesTest, DrawsTheLensOnceByTheGivenFunction) {
  const PreparedPlan plan = prepared(suite_text("\"toy-walker\""));
  int asked = 0;
  RunOptions with_drawing = options("a");
  with_drawing.draw_lens = [&asked](const plugin_host::Choice& scene) {
    ++asked;
    return "<svg>" + scene.id + "</svg>";
  };
  run(plan, with_drawing);
  run(plan, with_drawing);
  EXPECT_EQ(asked, 1);
  std::string drawing;
  for (const auto& entry : fs::directory_iterator(folder_ / "a/scenes")) drawing = read_file(entry.path() / "lens.svg");
  EXPECT_EQ(drawing, "<svg>toy-scene</svg>");
  run(plan, options("b"));
  for (const auto& entry : fs::directory_iterator(folder_ / "b/scenes"))
    EXPECT_FALSE(fs::exists(entry.path() / "lens.svg"));
}

// The camera fails along x: the landscape is missing, and nothing else.
TEST_F(PicturesTest, FailingSceneLosesOnlyItsLandscape) {
  const PreparedPlan plan =
      prepared(R"({"scenes": [{"use": "toy-scene", "name": "fragile", "parameters": {"blind_above": 0.99}}],
    "noise_levels": ["toy-level"], "instances": 2, "steps": 3, "algorithms": ["toy-walker"]})");
  const RunSummary summary = run(plan, options("a"));
  EXPECT_EQ(summary.failed, 0U);
  EXPECT_TRUE(scene_json(folder_ / "a", "landscape.json").is_null());
  EXPECT_TRUE(scene_json(folder_ / "a", "description.json").is_object());
  EXPECT_TRUE(fs::exists(folder_ / "a/pictures/index.json"));
  EXPECT_THAT(messages_, testing::Contains(testing::HasSubstr("nothing to see up there")));
}

}  // namespace
}  // namespace relign::runner
