// Further scores of a scene, and readings that methods know by name.
#include <algorithm>

#include "cli/scored_scene.h"
#include "resealed.h"

namespace relign::cli_test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class CliFurtherScores : public ScoredScene {};

// The example with the misalignment of its tips as a further score.
constexpr const char* kScore = R"("resolution": 0.01, "reading": "loss"})";
constexpr const char* kFurther = R"("resolution": 0.01, "reading": "loss",
                                    "further": [{"name": "distance", "unit": "um"}, {"name": "gap", "unit": "um"}]})";
constexpr const char* kMeasured = R"(
    def further_score(self, pose, seed, which):
        return 100 * sum(abs(p - 0.5) for p in pose) if which == 0 else pose[2]

)";

TEST_F(CliFurtherScores, FurtherOnesAreRecordedLimitedAndShown) {
  scene_with(kScore, kFurther);
  std::string source = place_.read("scene.py");
  const std::size_t at = source.find("\nclass Fibre(Scene)");
  ASSERT_NE(at, std::string::npos);
  place_.write("scene.py", source.insert(at, kMeasured));
  std::string text = suite(R"("score": 1.0, "further_scores": {"gap": 0.6})");
  text.replace(text.find("fibre.py"), 8, "scene.py");
  place_.write("suite.json", text);
  const Outcome run = call({"run", "suite.json", "-o", "out"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("gap 0.600 um"));
  const json group = json::parse(call({"report", "out", "--format", "json"}).out)["results"][0]["groups"][0];
  EXPECT_EQ(group["score"]["further"][1]["name"], "gap");
  const json row = group["rows"][0];

  std::vector<double> gaps;
  std::size_t met = 0;
  for (const auto& [last, closing] : trials()) {
    if (closing["algorithm"] != row["method"]) continue;
    const json& gap = closing["further_score_2"];
    ASSERT_EQ(gap.size(), closing["steps"]);
    EXPECT_EQ(gap.back(), last["recommended_true_pose"][2]);
    EXPECT_EQ(closing["own_optimum_further_scores"][1], closing["own_optimum_pose"][2]);
    gaps.push_back(gap.back());
    met += gap.back() <= 0.6 && last["recommended_mse"] <= 1.0;
  }
  ASSERT_EQ(gaps.size(), 3U);
  std::sort(gaps.begin(), gaps.end());
  EXPECT_NEAR(row["further_scores"][1]["median"].get<double>(), gaps[1], 1e-3);
  EXPECT_NEAR(row["yield"]["share"].get<double>(), static_cast<double>(met) / 3, 1e-9);
  EXPECT_THAT(place_.read("out/report.html"), AllOf(HasSubstr("Further scores"), HasSubstr("gap 0.600 um")));
  const std::string median = row["further_scores"][1]["median"].dump();
  EXPECT_THAT(
      call({"report", "out", "--format", "csv"}).out,
      AllOf(Not(HasSubstr("nan")), HasSubstr(",further_score_2_hi95\n"), HasSubstr(",gap,um," + median.substr(0, 5))));
  EXPECT_THAT(call({"report", "out", "--format", "md"}).out,
              AllOf(HasSubstr("; then the medians of distance in um, gap in um"), HasSubstr(", gap ")));
  const Outcome checked = call({"plugin", "check", "./scene.py"});
  EXPECT_EQ(checked.exit_code, 0) << checked.out << checked.err;
  const Outcome verified = call({"verify", "out"});
  EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;

  const std::string kept = place_.read("out/trials/0000.jsonl"), there = R"("own_optimum_further_scores":[)";
  std::string forged = kept;
  forged.insert(forged.find(there) + there.size(), "-5,");
  place_.write("out/trials/0000.jsonl", records::resealed(forged));
  EXPECT_THAT(call({"report", "out"}).err, HasSubstr("'own_optimum_further_scores'"));

  text.replace(text.find("\"gap\""), 5, "\"gab\"");
  place_.write("suite.json", text);
  const Outcome unknown = call({"validate", "suite.json"});
  EXPECT_NE(unknown.exit_code, 0);
  EXPECT_THAT(unknown.err, HasSubstr("'gab', which the scene does not declare; it declares 'distance', 'gap'"));
}

TEST_F(CliFurtherScores, AFurtherOneBelowZeroFailsTheTrialAndKeepsItsSteps) {
  scene_with(kScore, kFurther);
  std::string source = place_.read("scene.py");
  source.insert(source.find("\nclass Fibre(Scene)"), R"(
    def further_score(self, pose, seed, which):
        return 0.01 - abs(pose[0] - 0.5)  # not below 0 at the nominal pose, which is tried before the run

)");
  place_.write("scene.py", source);
  place_.write("suite.json", R"({"name": "f", "scenes": ["./scene.py"], "noise_levels": ["declared"],
                                 "algorithms": ["random"], "instances": 1, "steps": 2})");
  EXPECT_NE(call({"run", "suite.json", "-o", "out"}).exit_code, 0);
  for (const auto& [last, closing] : trials()) {
    EXPECT_EQ(closing["end"], "failed") << closing;
    EXPECT_THAT(closing["message"].get<std::string>(), HasSubstr("'distance', but returned -")) << closing;
    EXPECT_GT(closing["steps"], 1) << closing;
  }
}

TEST_F(CliFurtherScores, AFurtherOneThatIsNoNumberIsNamedByTheTrial) {
  scene_with(kScore, kFurther);
  std::string source = place_.read("scene.py");
  place_.write("scene.py", source.insert(source.find("\nclass Fibre(Scene)"), R"(
    def further_score(self, pose, seed, which):
        return float("nan") if which else 1.0

)"));
  place_.write("suite.json", R"({"name": "f", "scenes": ["./scene.py"], "noise_levels": ["declared"],
                                 "algorithms": ["random"], "instances": 1, "steps": 2})");
  EXPECT_THAT(call({"run", "suite.json", "-o", "out"}).err,
              HasSubstr("declares the further score 'gap', but measuring it"));
}

TEST_F(CliFurtherScores, OneLimitForScoresOfDifferentUnitsIsRefused) {
  std::string source = place_.read("fibre.py");
  for (const auto& [word, other] :
       {std::pair{R"("dB")", "'mW'"}, {R"("fibre")", "'other'"}, {"fibre-both", "other-both"}})
    for (std::size_t at; (at = source.find(word)) != std::string::npos;)
      source.replace(at, std::string_view(word).size(), other);
  place_.write("scene.py", source);
  std::string text = suite(R"("score": 1.0)");
  place_.write("suite.json", text.replace(text.find("\"./fibre.py\""), 12, R"("./fibre.py", "./scene.py")"));
  for (const std::vector<std::string>& command : {std::vector<std::string>{"validate"}, {"run", "-o", "out"}}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.begin() + 1, "suite.json");
    const Outcome outcome = call(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << command[0];
    EXPECT_THAT(outcome.err, AllOf(HasSubstr("'score' limits insertion loss in dB on the scene 'fibre'"),
                                   HasSubstr("insertion loss in mW on 'other'")));
  }
}

TEST_F(CliFurtherScores, FurtherOnesThatNothingMeasuresAreRefused) {
  EXPECT_THAT(found_by_the_checks(kScore, kFurther), HasSubstr("does not offer relign.scene.further-score/1"));
  place_.write("suite.json", R"({"name": "f", "scenes": ["./scene.py"], "noise_levels": ["declared"],
                                 "algorithms": ["random"], "instances": 1, "steps": 2})");
  const Outcome run = call({"run", "suite.json", "-o", "out"});
  EXPECT_NE(run.exit_code, 0);
  EXPECT_THAT(run.err, HasSubstr("declares the further score 'distance', but its assembly gives none"));
  const std::string same = R"("resolution": 0.01, "reading": "loss", "further": [{"name": "insertion loss"}]})";
  EXPECT_THAT(found_by_the_checks(kScore, same), HasSubstr("that of another score, found 'insertion loss'"));
}

TEST_F(CliFurtherScores, ReadingsAreKnownByNameToMethodsThatObserveThem) {
  const auto method = [&](const std::string& observes, const std::string& body) {
    place_.write(
        "method.py",
        "from relign_bench.plugin import Optimizer, serve\n\n\nclass Mine(Optimizer):\n    \"\"\"Reads.\"\"\"\n"
        "    id = \"mine\"\n    observes = (" +
            observes + ")\n\n    def run(self, trial):\n" + body + "\n\n\nserve(Mine)\n");
    return call({"try", "./method.py", "--scene", "./fibre.py", "--noise-level", "declared", "--protocol", "blind",
                 "--steps", "2"});
  };
  const std::string known = R"(        assert trial.readings == [{"name": "loss", "unit": "dB"}], trial.readings
        seen = trial.step([0.1] * 6)
        assert seen.readings == {"loss": float(seen.image[0, 0])}, seen.readings
        assert abs(seen.readings["loss"] - seen.merit) < 1e-5)";
  const Outcome reads = method(R"("merit", "images")", known);
  EXPECT_EQ(reads.exit_code, 0) << reads.out << reads.err;
  const Outcome blind = method(R"("merit",)", R"(        assert trial.readings == []
        trial.first.readings)");
  EXPECT_NE(blind.exit_code, 0);
  EXPECT_THAT(blind.out + blind.err, HasSubstr("add \"images\" to the class's observes"));
}

// What a scene cannot have is said where it is met, and neither a trial nor a run ends as if nothing was wrong.
}  // namespace
}  // namespace relign::cli_test
