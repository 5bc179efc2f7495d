// Scenes that declare their score, and readings instead of an image: from a run to its report, and mistakes.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/scored_scene.h"
#include "resealed.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;
using testing::Not;

class CliScores : public ScoredScene {};

TEST_F(CliScores, AreNamedFromTheTrialToTheReport) {
  const Outcome tried = call({"try", "coordinate-walk", "--scene", "./fibre.py", "--noise-level", "declared",
                              "--protocol", "blind", "--steps", "3"});
  EXPECT_EQ(tried.exit_code, 0) << tried.err;
  EXPECT_THAT(tried.err, AllOf(HasSubstr("insertion loss in dB; commanded"), Not(HasSubstr("RMSE"))));

  const Outcome run = call({"run", "suite.json", "-o", "out"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("noise-free insertion loss in dB"), HasSubstr("spec: insertion loss 1.00 dB")));
  const json manifest = json::parse(place_.read("out/manifest.json"));
  EXPECT_EQ(manifest["scenes"][0]["score"]["name"], "insertion loss");
  const std::string page = place_.read("out/report.html");
  EXPECT_THAT(page,
              AllOf(HasSubstr("insertion loss in dB"), Not(HasSubstr("RMSE")), Not(HasSubstr("reference image"))));
  EXPECT_THAT(page, HasSubstr("Each step is one move and one reading."));
  std::string shown = page.substr(0, page.find("<section id=\"methods\">"));  // plugins have words of their own
  for (const char* tag : {"style", "script"})
    for (std::size_t at; (at = shown.find("<" + std::string(tag))) != std::string::npos;)
      shown.erase(at, shown.find("</" + std::string(tag), at) + 1 - at);
  for (const char* word : {"image", "lens", "pixel", "camera"})
    EXPECT_THAT(shown, Not(HasSubstr(word))) << shown.substr(shown.find(word) - 200, 400);
  for (const char* format : {"csv", "md", "json"}) {
    const Outcome report = call({"report", "out", "--format", format});
    EXPECT_EQ(report.exit_code, 0) << report.err;
    EXPECT_THAT(report.out, AllOf(HasSubstr("insertion loss"), Not(HasSubstr("RMSE")), Not(HasSubstr("nan"))))
        << format;
  }
  const json group = json::parse(call({"report", "out", "--format", "json"}).out)["results"][0]["groups"][0];
  EXPECT_EQ(group["score"]["unit"], "dB");
  EXPECT_EQ(group["spec_score"], 1.0);
}

TEST_F(CliScores, AreShownAsRecordedAndInExcessByDifference) {
  ASSERT_EQ(call({"run", "suite.json", "-o", "out"}).exit_code, 0);
  const json row = json::parse(call({"report", "out", "--format", "json"}).out)["results"][0]["groups"][0]["rows"][0];
  std::vector<double> scores, excess;
  for (const auto& [last, closing] : trials()) {
    if (closing["algorithm"] != row["method"]) continue;
    scores.push_back(last["recommended_mse"]);
    excess.push_back(scores.back() - closing["own_optimum_mse"].get<double>());
    EXPECT_GT(excess.back(), -1e-6);
  }
  ASSERT_EQ(scores.size(), 3U);
  std::sort(scores.begin(), scores.end());
  std::sort(excess.begin(), excess.end());
  EXPECT_NEAR(row["recommended"]["median"].get<double>(), scores[1], 1e-4 * scores[1]) << row;
  EXPECT_NEAR(row["excess"].back()["own"]["median"].get<double>(), excess[1], 1e-3 * excess[1]) << row["excess"];
}

TEST_F(CliScores, AreMergedVerifiedAndChecked) {
  ASSERT_EQ(call({"plan", "suite.json", "-o", "plan.json", "--shards", "2"}).exit_code, 0);
  for (const char* shard : {"0/2", "1/2"})
    ASSERT_EQ(call({"run", "--plan", "plan.json", "--shard", shard}).exit_code, 0);
  ASSERT_EQ(call({"merge", "results/fibre", "-o", "merged"}).exit_code, 0);
  const Outcome verified = call({"verify", "merged"});
  EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
  std::string trials = place_.read("merged/trials/0000.jsonl");
  const std::size_t at = trials.find("\"recommended_mse\":");
  const std::size_t value = at + sizeof "\"recommended_mse\":" - 1;
  trials.replace(value, trials.find(',', value) - value, "-3");
  place_.write("merged/trials/0000.jsonl", records::resealed(trials));
  const Outcome forged = call({"report", "merged"});
  EXPECT_NE(forged.exit_code, 0);
  EXPECT_THAT(forged.out + forged.err, HasSubstr("'recommended_mse' -3"));
}

TEST_F(CliScores, BelowZeroAreShownAndFailTheRun) {
  scene_with("return loss_db(self.share(true_pose)), 0.0", "return loss_db(self.share(true_pose)) - 90, 0.0");
  const Outcome tried = call({"try", "coordinate-walk", "--scene", "./scene.py", "--noise-level", "declared",
                              "--protocol", "blind", "--steps", "1"});
  EXPECT_THAT(tried.out, AllOf(HasSubstr("  -30.00000"), Not(HasSubstr("<0.01"))));
  place_.write("fibre.py", place_.read("scene.py"));
  const Outcome run = call({"run", "suite.json", "-o", "out"});
  EXPECT_EQ(run.exit_code, 4) << run.err;
  EXPECT_EQ(call({"report", "out", "-o", "again.html"}).exit_code, run.exit_code);
  EXPECT_THAT(run.err, HasSubstr("failed check: out: scores: trial "));
  EXPECT_THAT(run.out, AllOf(HasSubstr("FAILED scores: "), HasSubstr("report   out/report.html")));
  EXPECT_TRUE(fs::exists(place_.path("out/report.html")));
}

// As any other scene: a method in a sandbox has the same trials, an evaluation is ranked, and a cluster runs a plan.
TEST_F(CliScores, RunInASandboxOnALeaderboardAndOnACluster) {
  ASSERT_EQ(call({"run", "suite.json", "-o", "out"}).exit_code, 0);
  const Outcome confined = call({"run", "suite.json", "-o", "confined", "--sandbox"});
  if (confined.err.find("not possible on this machine") != std::string::npos) GTEST_SKIP() << confined.err;
  ASSERT_EQ(confined.exit_code, 0) << confined.err;
  EXPECT_EQ(place_.read("confined/instances.csv"), place_.read("out/instances.csv"));

  fs::create_directories(place_.path("sub"));
  fs::copy_file(RELIGN_SOURCE_DIR "/examples/compass_python/compass.py", place_.path("sub/compass.py"));
  place_.write("sub/submission.json", R"({"name": "ours", "version": "1.0", "summary": "Compass search.",
    "authors": ["A. Nonymous"], "licence": "Apache-2.0", "plugin": "compass.py", "algorithm": {"use": "compass"}})");
  ASSERT_EQ(call({"submit", "pack", "sub", "-o", "ours.tar"}).exit_code, 0);
  const Outcome evaluated =
      call({"submit", "evaluate", "ours.tar", "--suite", "suite.json", "-o", "ev", "--baselines", "confined"});
  ASSERT_EQ(evaluated.exit_code, 0) << evaluated.err;
  const Outcome board = call({"leaderboard", "build", "ev", "-o", "site"});
  EXPECT_EQ(board.exit_code, 0) << board.err;
  EXPECT_THAT(place_.read("site/index.html"), AllOf(HasSubstr("coordinate-walk"), HasSubstr("ours")));
  EXPECT_THAT(place_.read("site/feed.json"), HasSubstr("fibre"));

  ASSERT_EQ(call({"plan", "suite.json", "-o", "plan.json", "--shards", "2"}).exit_code, 0);
  EXPECT_THAT(call({"slurm", "script", "--plan", "plan.json"}).out, HasSubstr("#SBATCH --array=0-1"));
}

TEST_F(CliScores, SpecificationOfAnotherScoreIsRefused) {
  place_.write("suite.json", suite(R"("rmse": 0.01)"));
  const Outcome outcome = call({"validate", "suite.json"});
  EXPECT_EQ(outcome.exit_code, 2) << outcome.out;
  EXPECT_THAT(outcome.err,
              HasSubstr("it limits 'rmse', but the scene is judged by its insertion loss in dB; use 'score'"));
  place_.write("suite.json", suite(R"("rmse": 0.01, "score": 1)"));
  EXPECT_EQ(call({"validate", "suite.json"}).exit_code, 2);
  place_.write("suite.json", R"({"scenes": ["relign_od"], "noise_levels": ["rho0"], "algorithms": ["random"],
                                 "instances": 1, "steps": 1, "spec": {"score": 1}})");
  EXPECT_THAT(call({"validate", "suite.json"}).err, HasSubstr("the scene is judged by its RMSE; use 'rmse'"));
  place_.write("suite.json", R"({"scenes": ["relign_od"], "noise_levels": ["rho0"], "algorithms": ["random"],
                                 "instances": 1, "steps": 1, "targets": [2, 1]})");
  EXPECT_THAT(call({"validate", "suite.json"}).err, HasSubstr("found the target 2; targets of the scene 'relign_od'"));
}

TEST_F(CliScores, MistakesOfAScoreAreFoundByTheChecks) {
  EXPECT_EQ(call({"plugin", "check", "./fibre.py"}).exit_code, 0);
  EXPECT_THAT(found_by_the_checks("return loss_db(self.share(true_pose)), 0.0", "return self.share(true_pose), 0.0"),
              HasSubstr("although the lower score is the better; declare what is missing"));
  EXPECT_THAT(found_by_the_checks(R"("resolution": 0.01, "reading": "loss")", R"("resolution": 0.01)"),
              HasSubstr("missing key 'reading'"));
  EXPECT_THAT(found_by_the_checks(R"([{"name": "loss", "unit": "dB"}])", R"([{"name": "loss", "unit": "mW"}])"),
              HasSubstr("is 'dB', but that of the reading 'loss' is 'mW'"));
  EXPECT_THAT(found_by_the_checks("return loss_db(self.share(true_pose)), 0.0",
                                  "return 100 * loss_db(self.share(true_pose)), 0.0"),
              HasSubstr("its noise-free reading 'loss' is"));
  EXPECT_THAT(found_by_the_checks("return [loss_db(abs(share + DARK + noise))]", "return [math.nan]"),
              HasSubstr("non-finite"));
  EXPECT_THAT(found_by_the_checks("return [loss_db(abs(share + DARK + noise))]", "return [1.0, 2.0]"),
              HasSubstr("capture() returned 2 readings, expected 1 reading"));
}

// A capture takes 20 ms, but not again at the pose and seed of the last.
TEST_F(CliScores, TheForecastCountsCapturesThatASceneDoesNotKeep) {
  const std::string before = "    def capture(self, true_pose, frame_seed):\n";
  std::string source;
  {
    std::ifstream file(RELIGN_SOURCE_DIR "/templates/scene-readings-python/my_plugin.py");
    source.assign(std::istreambuf_iterator<char>(file), {});
  }
  const std::size_t at = source.find(before);
  ASSERT_NE(at, std::string::npos);
  source.insert(at + before.size(),
                "        import time\n"
                "        last, self.last = getattr(self, 'last', None), (tuple(true_pose), frame_seed)\n"
                "        time.sleep(0 if self.last == last else 0.02)\n");
  place_.write("slow.py", source);
  place_.write("slow.json", R"({"scenes": ["./slow.py"], "noise_levels": ["declared"], "protocol": "blind",
                               "algorithms": ["nlopt-neldermead"], "instances": 20, "steps": 50})");
  const Outcome outcome = call({"--json", "validate", "slow.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json found = json::parse(outcome.out);
  constexpr double kOfMethods = 0.5;  // home moves once
  EXPECT_GT(found["expected_seconds"].get<double>() * found["cores"].get<double>(),
            0.02 * kOfMethods * found["frames"].get<double>())
      << found;
}

TEST_F(CliScores, AMethodForOneSceneIsCheckedOnIt) {
  fs::copy_file(RELIGN_SOURCE_DIR "/templates/scene-readings-python/my_plugin.py", place_.path("pinhole.py"));
  place_.write("axes.py", R"("""Only for three axes and one reading, which is what measures the score."""
from relign_bench.plugin import Optimizer, serve


class Axes(Optimizer):
    observes = ("merit", "images", "box")

    def run(self, trial):
        seen, pose = trial.first, list(trial.first.pose)
        for axis in range(30):
            if len(pose) != 3 or seen.image.shape != (1, 1) or list(seen.readings) != ["loss"]:
                raise ValueError(f"{len(pose)} axes and an image of {seen.image.shape}")
            pose[axis % 3] = 0.01 * axis
            seen = trial.step(pose)
            if seen is None:
                return


if __name__ == "__main__":
    serve(Axes)
)");
  const Outcome alone = call({"plugin", "check", "./axes.py"});
  EXPECT_EQ(alone.exit_code, 5) << alone.out << alone.err;
  EXPECT_THAT(alone.out, HasSubstr("5 axes and an image of (40, 40)"));
  const Outcome there = call({"plugin", "check", "./axes.py", "--scene", "./pinhole.py"});
  EXPECT_EQ(there.exit_code, 0) << there.out << there.err;
  EXPECT_THAT(there.out,
              AllOf(HasSubstr("[ok]      runs"), HasSubstr("[ok]      same-trace"), HasSubstr("[skipped] dimensions"),
                    HasSubstr("with the 3 axes of '"), HasSubstr("passed")));
  EXPECT_THAT(
      call({"plugin", "check", "./axes.py", "--scene", R"({"use": "./pinhole.py", "parameters": {"a": 1}})"}).err,
      HasSubstr("has no parameter 'a'"))
      << "an object as in a suite";
  const Outcome scene = call({"plugin", "check", "./pinhole.py", "--scene", "./pinhole.py"});
  EXPECT_EQ(scene.exit_code, 2) << scene.out;
  EXPECT_THAT(scene.err, HasSubstr("--scene is for optimizers and agents"));
  EXPECT_EQ(call({"plugin", "check", "./axes.py", "--scene", "./axes.py"}).exit_code, 2);
  EXPECT_EQ(call({"plugin", "check", "./axes.py", "--scene", ""}).exit_code, 2) << "an unset variable of a shell";
}

TEST_F(CliScores, AnOptimumOutsideOfTheTravelRejectsThePluginInOneSentence) {
  scene_with("def own_optimum(self, seed):",
             "def own_optimum(self, seed):\n        return [1.5] * 6, 0.0, 0.0\n\n    def known(self, seed):");
  place_.write("bad.json", R"({"scenes": ["./scene.py"], "noise_levels": ["declared"], "protocol": "blind",
                              "algorithms": ["nlopt-neldermead"], "instances": 2, "steps": 5})");
  const Outcome outcome = call({"validate", "bad.json"});
  EXPECT_EQ(outcome.exit_code, 5) << outcome.out << outcome.err;
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("own_optimum"), HasSubstr("expected 0 to 1 on every axis"),
                                 HasSubstr("plugin check"), Not(HasSubstr("internal"))));
}

// Faults that the perfect device does not show, since it has no uncertain quantity.
TEST_F(CliScores, MistakesOfDevicesAreFoundByTheChecks) {
  fs::copy_file(RELIGN_SOURCE_DIR "/templates/scene-readings-python/my_plugin.py", place_.path("pinhole.py"));
  const std::string pinhole = place_.read("pinhole.py");
  const auto found = [&](const std::vector<std::pair<std::string, std::string>>& changes) {
    std::string source = pinhole;
    for (const auto& [text, other] : changes) {
      const std::size_t at = source.find(text);
      EXPECT_NE(at, std::string::npos) << text;
      source.replace(at, text.size(), other);
    }
    place_.write("pinhole.py", source);
    return call({"plugin", "check", "--one", "devices", "--report", "1", "pinhole.py"}).out;
  };
  EXPECT_THAT(found({}), AllOf(HasSubstr("outside the box that methods observe under 'blind'"), HasSubstr("ok")));
  EXPECT_THAT(found({{"return [loss_db(true_pose, self.focus) +", "return [0.3 * loss_db(true_pose, self.focus) +"}}),
              HasSubstr("what captures measure of the score is 0."));
  EXPECT_THAT(found({{"random.Random(frame_seed)", "random.Random(1)"}}),
              AllOf(HasSubstr("captures do not depend on the frame seed"), HasSubstr("warning")));
  EXPECT_THAT(found({{"0.5 + 0.5 * place / half", "0.5 - 0.5 * place / half"}}),
              AllOf(HasSubstr("dB at its optimum, but"), HasSubstr("failed")));
  EXPECT_THAT(found({{"return pose, *self.score(pose, seed)", "return pose, 0.3, 0.0"}}),
              HasSubstr("its optimum is stated to score 0.300 dB, but scores 0 dB"));
  EXPECT_THAT(
      found({{"return loss_db(true_pose, self.focus), 0.0", "return 0.1 * loss_db(true_pose, self.focus), 0.0"}}),
      HasSubstr("what measures the score is 10.00 times the score"));
  EXPECT_THAT(found({{"\"x\": 50.0", "\"x\": 10.0"}}), HasSubstr("8 devices is at an end of the travel of 'x'"));
  EXPECT_THAT(found({{"return min(-10", "return 0.7 + min(-10"}}),
              HasSubstr("none of 8 devices is in specification at its optimum"));
  EXPECT_THAT(found({{"\"score\": 0.5", "\"score\": 70.0"}}),
              HasSubstr("the specification of 70.0 dB is already met at the start of 8 of 8 devices"));
  EXPECT_THAT(found({{"RAYLEIGH_MM = 5.0", "RAYLEIGH_MM = 1e9"}}),
              AllOf(HasSubstr("does not depend on 'z' around the best poses"),
                    HasSubstr("depend on the uncertain quantity 'focus_z'"), HasSubstr("warning")));
  const std::pair<std::string, std::string> narrow = {"WAIST_UM = 40.0", "WAIST_UM = 0.05"};
  EXPECT_THAT(found({narrow}), HasSubstr("the score is 60.0 dB at the start of every device"));
  EXPECT_THAT(found({narrow,
                     {"def own_optimum(", "def known("},
                     {"\"elements\": [],", "\"elements\": [], \"own_optimum\": \"searched\","}}),
              AnyOf(HasSubstr("two searches for its optimum end at"), HasSubstr("the score does not depend on 'x'")));
}

TEST_F(CliScores, DevicesAreSeenAtTheirOwnOptimum) {
  const auto posed = [this](const std::string& pose) {
    const Outcome outcome = call({"render", "--scene", "./fibre.py", "--noise-level", "declared", "--instance", "3",
                                  "--pose", pose, "--noise-free", "-o", "one.npy", "--json"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::string pixel = place_.read("one.npy");
    float loss = 0;
    std::memcpy(&loss, pixel.data() + pixel.size() - sizeof loss, sizeof loss);
    return loss;
  };
  EXPECT_LT(posed("optimum"), 1);
  EXPECT_GT(posed("nominal"), posed("optimum"));
  scene_with("def own_optimum(", "def known_optimum(");
  EXPECT_THAT(call({"render", "--scene", "./scene.py", "--pose", "optimum"}).err,
              HasSubstr("neither has nor searches for optima"));
}

// A trial names the reading and the score, not pixels and a mean squared error of which the scene knows nothing.
TEST_F(CliScores, MistakesOfAScoreAreNamedByTheTrial) {
  const auto found_by_the_trial = [this](const std::string& text, const std::string& other) {
    scene_with(text, other);
    const Outcome tried = call({"try", "home", "--scene", "./scene.py", "--noise-level", "declared", "--steps", "1"});
    EXPECT_NE(tried.exit_code, 0) << tried.out;
    std::string error = tried.err.substr(tried.err.find("error: "));
    error.resize(std::min(error.find('\n'), error.size()));
    EXPECT_THAT(error, AllOf(Not(HasSubstr("mse")), Not(HasSubstr("pixel")))) << "without the traceback, if any";
    return error;
  };
  EXPECT_THAT(found_by_the_trial("return [loss_db(abs(share + DARK + noise))]", "return [math.nan]"),
              HasSubstr("the capture of step 0 has a non-finite reading 'loss'"));
  const std::string score = "return loss_db(self.share(true_pose)), 0.0";
  EXPECT_THAT(found_by_the_trial(score, "return loss_db(self.share(true_pose))"),
              HasSubstr("failed in score: TypeError: score() returned float, expected two values (insertion loss, "
                        "standard_error)"));
  EXPECT_THAT(found_by_the_trial(score, "return math.nan, 0.0"),
              HasSubstr("the insertion loss of score() is nan, expected a finite number"));
  EXPECT_THAT(found_by_the_trial(score, "return 1.0, -1.0"), HasSubstr("failed in score: value or standard error"));
  EXPECT_THAT(found_by_the_checks("return pose, *self.score(pose, seed)", "return pose, 1.0"),
              HasSubstr("expected three values (true_pose, insertion loss, standard_error)"));
}

// The example knows its best poses; without them the harness finds the same scores, once for each instance.
TEST_F(CliScores, OwnOptimaAreSearchedForOnRequest) {
  const auto own_optima = [this](const std::string& scene) {
    std::string text = suite(R"("score": 1.0)");
    text.replace(text.find("./fibre.py"), 10, scene);
    place_.write("suite.json", text);
    EXPECT_EQ(call({"run", "suite.json", "-o", scene + ".out"}).exit_code, 0);
    std::vector<double> scores;
    std::istringstream lines(place_.read(scene + ".out/trials/0000.jsonl"));
    for (std::string line; std::getline(lines, line);)
      if (const json read = json::parse(line); read.contains("end"))
        scores.push_back(read["own_optimum_mse"].is_number() ? read["own_optimum_mse"].get<double>() : std::nan(""));
    return scores;
  };
  const std::vector<double> known = own_optima("./fibre.py");
  scene_with("def own_optimum(", "def known_optimum(");
  place_.write("fibre.py", place_.read("scene.py"));
  EXPECT_THAT(own_optima("./scene.py"), testing::Each(testing::IsNan())) << "not asked for";
  scene_with(R"("elements": [],)", R"("elements": [], "own_optimum": "searched",)");
  const std::vector<double> searched = own_optima("./scene.py");
  ASSERT_EQ(searched.size(), known.size());
  for (std::size_t i = 0; i < known.size(); ++i) {
    EXPECT_NEAR(searched[i], known[i], 1e-3) << "dB";
    EXPECT_GE(searched[i], known[i] - 1e-9) << "no pose is better than the best";
  }
  EXPECT_EQ(call({"plugin", "check", "./scene.py"}).exit_code, 0);
  EXPECT_THAT(found_by_the_checks(R"("elements": [],)", R"("elements": [], "own_optimum": "known",)"),
              HasSubstr("expected \"searched\", or no 'own_optimum'; found 'known'"));
}

}  // namespace
}  // namespace relign::cli_test
