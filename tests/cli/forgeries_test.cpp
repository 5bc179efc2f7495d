// Forged results folders: a change to a good folder with correct checksums, and what each command finds without a
// replay.
#include <gmock/gmock.h>

#include <functional>

#include "cli/forged_results.h"
#include "cli/program.h"

namespace relign::cli_test::forged {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

void rename(Json& value, const std::string& from, const std::string& to) {
  if (value == from) value = to;
}

std::function<void(Results&)> manifest_member(const char* key, Json value) {
  return [key, value = std::move(value)](Results& results) { results.manifest[key] = value; };
}

std::function<void(Results&)> of_rival(const char* key, Json value) {
  return [key, value = std::move(value)](Results& results) { results.method(kRival)[key] = value; };
}

// In the text of the lines of the rival's first trial.
std::function<void(Results&)> in_lines(std::string replace, std::string by) {
  return [replace = std::move(replace), by = std::move(by)](Results& results) {
    results.of(kRival)[0]->replace = replace;
    results.of(kRival)[0]->by = by;
  };
}

// In the list of the manifest, in its suite and in the records.
void rename_everywhere(Results& results, const char* list, const char* of_record, const std::string& from,
                       const std::string& to, bool in_suite) {
  for (Json& entry : results.manifest[list]) rename(entry["name"], from, to);
  for (Trial& trial : results.trials) rename(trial.closing[of_record], from, to);
  if (!in_suite) return;
  Json suite = results.suite();
  for (Json& entry : suite[list])
    if (entry == from) entry = Json{{"use", from}, {"name", to}};
  results.manifest["suite"] = suite.dump();
}

void change_suite(Results& results, const std::function<void(Json&)>& change) {
  Json suite = results.suite();
  change(suite);
  results.manifest["suite"] = suite.dump();
}

const std::vector<Forgery>& forgeries() {
  static const std::vector<Forgery> all = {
      // the manifest against itself and its suite
      {"a list", of_rival("of_list", {{"method", "m"}, {"training", "t"}}),
       "names no training of a method of the suite"},
      {"oracle", of_rival("oracle", true), "is marked as an oracle, but this protocol gives the true start"},
      {"spec", manifest_member("spec", {{"rmse", 0.5}}), "'spec' is {\"rmse\":0.01} in the suite"},
      {"spec removed", [](Results& of) { of.manifest.erase("spec"); }, "manifest.json is damaged: it lacks 'spec'"},
      {"merit", of_rival("merit", "rmse"), "'merit' of 'nlopt-bobyqa' (protocol paper) is \"combined\" in the suite"},
      {"budget", of_rival("steps", 3), "'steps' of 'nlopt-bobyqa' (protocol paper) is 4 in the suite and 3"},
      {"added", of_rival("added", true), "as added by the program, which adds baselines only"},
      {"protocol",
       [](Results& of) {
         of.method(kRival)["protocol"] = "blind";
         for (Trial* trial : of.of(kRival)) trial->closing["protocol"] = "blind";
       },
       "the suite has the method 'nlopt-bobyqa' (protocol paper), the manifest does not"},
      {"suite name", manifest_member("suite_name", "official"), "'suite_name' is 'official', but the suite is called"},
      {"scene name", [](Results& of) { rename_everywhere(of, "scenes", "scene", "gaussian_spot", "relign_od", false); },
       "the manifest has 'relign_od' in 'scenes', the suite does not"},
      {"level name", [](Results& of) { rename_everywhere(of, "noise_levels", "noise_level", "rho0", "rho0.5", false); },
       "the manifest has 'rho0.5' in 'noise_levels', the suite does not"},
      {"method name", [](Results& of) { rename_everywhere(of, "algorithms", "algorithm", kRival, "rival", false); },
       "the manifest has the method 'rival' (protocol paper), the suite does not"},
      {"look-alike name",
       [](Results& of) { rename_everywhere(of, "algorithms", "algorithm", kRival, "nl\u043Ept-sbplx", true); },
       "the letters must be of one script"},
      {"look-alike name of one script",
       [](Results& of) { rename_everywhere(of, "algorithms", "algorithm", kRival, "\u0440\u0440\u043E", true); },
       "Cyrillic or Armenian letters all look like Latin ones"},
      {"method removed",
       [](Results& of) {
         Json kept = Json::array(), order = Json::array();
         for (const Json& entry : of.manifest["algorithms"])
           if (entry["name"] != kRival) kept.push_back(entry);
         std::set<std::string> gone;
         for (const Trial* trial : of.of(kRival)) gone.insert(trial->closing["trial"]);
         for (const Json& id : of.manifest["order"])
           if (!gone.count(id)) order.push_back(id);
         of.manifest["algorithms"] = kept;
         of.manifest["order"] = order;
         of.manifest["trials"] = order.size();
       },
       "the suite has 2 'algorithms', the manifest 1"},
      {"trials removed from the plan",
       [](Results& of) {
         of.manifest["order"].erase(0);
         of.manifest["trials"] = of.manifest["order"].size();
       },
       "but 'order' has 7"},
      {"number of trials", manifest_member("trials", 7), "'trials' is 7, but 'order' has 8"},
      {"order repeats", [](Results& of) { of.manifest["order"][0] = of.manifest["order"][1]; },
       "'order' repeats 1 trial"},
      {"order", [](Results& of) { std::swap(of.manifest["order"][0], of.manifest["order"][7]); }, "'order' lists"},
      {"instances", manifest_member("instances", 1), "'instances' is 2 in the suite and 1 in the manifest"},
      {"first instance", manifest_member("first_instance", 1), "'first_instance' is 0 in the suite and 1"},
      {"seed", manifest_member("seed", 2), "'seed' is 1 in the suite and 2 in the manifest"},
      {"limits", manifest_member("limits", "hard"), "'limits' is \"soft\" in the suite"},
      {"targets", manifest_member("targets", {0.5}), "'targets' is [] in the suite"},
      {"machine time", manifest_member("machine_time", {{"settle_ms", 1}}), "'machine_time' is {} in the suite"},
      {"commitment", manifest_member("commitment", "sha256:" + std::string(64, '0')), "the suite is open"},
      {"suite with a key twice",
       [](Results& of) {
         std::string text = of.manifest["suite"];
         text.insert(1, "\"instances\": 1, ");
         of.manifest["suite"] = text;
       },
       "the text of the suite is not a JSON object"},
      {"manifest with a key twice",
       [](Results& of) {
         of.replace = "\"instances\": 2";
         of.by = "\"instances\": 2, \"instances\": 2";
       },
       "duplicate key 'instances'"},
      // the manifest against the plan of its suite
      {"observations", of_rival("observes", {"images"}), "observes [\"images\"] by the manifest"},
      {"parameters", [](Results& of) { of.method(kRival)["parameters"]["first_step"] = 0.5; },
       "'parameters' of the algorithm 'nlopt-bobyqa' is"},
      {"kind", of_rival("kind", "scene"), "'kind' of the algorithm 'nlopt-bobyqa' is"},
      {"replayable", [](Results& of) { of.manifest["scenes"][0]["replayable"] = false; },
       "'replayable' of the scene 'gaussian_spot' is false in the manifest"},
      {"observations removed", [](Results& of) { of.method(kRival).erase("observes"); },
       "/algorithms/1 lacks 'observes'"},
      {"merit removed", [](Results& of) { of.method(kRival).erase("merit"); }, "/algorithms/1 lacks 'merit'"},
      {"budget removed", of_rival("steps", nullptr), "/algorithms/1/steps is null; expected an integer"},
      {"mark of an oracle removed", [](Results& of) { of.method("home").erase("oracle"); },
       "/algorithms/2 lacks 'oracle'"},
      {"suite with an empty entry",
       [](Results& of) { change_suite(of, [](Json& suite) { suite["algorithms"][1] = nullptr; }); },
       "the suite has the entry null in 'algorithms'"},
      {"plugin", of_rival("plugin", "random"), "'plugin' of the algorithm 'nlopt-bobyqa' is \"random\""},
      {"instance set", manifest_member("instance_set", std::string(16, '0')), "'instance_set' is '0000000000000000'"},
      // records against the manifest
      {"trials of another method",
       [](Results& of) {
         const std::vector<Trial*> rival = of.of(kRival), own = of.of(kOwn);
         for (Trial* trial : rival) trial->closing["algorithm"] = trial->closing["algorithm_id"] = kOwn;
         for (Trial* trial : own) trial->closing["algorithm"] = trial->closing["algorithm_id"] = kRival;
       },
       "'order' lists instance 0 of a method after a later trial"},
      {"algorithm", closing("algorithm_id", "random"), "is of the algorithm 'random', the manifest has 'nlopt-bobyqa'"},
      {"noise level", closing("noise_level", "rho1"), "has the noise level 'rho1', which the manifest does not have"},
      {"instance number", closing("instance", 7), "is on instance 7, but the manifest has 0 to 1"},
      {"instances swapped",
       [](Results& of) {
         const std::vector<Trial*> rival = of.of(kRival);
         std::swap(rival[0]->closing["instance"], rival[1]->closing["instance"]);
       },
       "has the instance seed"},
      {"budget of a trial", closing("budget", 9), "has a budget of 9 steps, the manifest 4"},
      {"end", closing("end", "won"), "ended by 'won', which is not an end of a trial"},
      {"recorded twice",
       [](Results& of) {
         Trial forged = *of.of(kOwn)[0];
         forged.steps.back()["recommended_mse"] = 1e-9;
         of.trials.insert(of.trials.begin(), forged);
       },
       "is recorded twice"},
      // a key twice
      {"score twice", in_lines("\"recommended_mse\":", "\"recommended_mse\":0.61,\"recommended_mse\":"),
       "duplicate key 'recommended_mse'"},
      {"score twice, one escaped",
       in_lines("\"recommended_mse\":", "\"recommended\\u005fmse\":0.61,\"recommended_mse\":"),
       "duplicate key 'recommended_mse'"},
      {"member that no table needs twice", in_lines("\"true_pose\":", "\"true_pose\":[0],\"true_pose\":"),
       "duplicate key 'true_pose'"},
      {"end twice", in_lines("\"end\":", "\"end\":\"failed\",\"end\":"), "duplicate key 'end'"},
      {"times twice",
       [](Results& of) {
         of.replace_time = "\"algorithm_seconds\":";
         of.by_time = "\"algorithm_seconds\":[0],\"algorithm_seconds\":";
       },
       "duplicate key 'algorithm_seconds'"},
      // completeness
      {"last step removed", [](Results& of) { of.of(kRival)[0]->steps.pop_back(); },
       "which with a budget of 4 means 5"},
      {"step beyond the budget",
       [](Results& of) {
         Trial& trial = *of.of(kOwn)[0];
         trial.steps.push_back(trial.steps.back());
         trial.steps.back()["step"] = 5;
       },
       "has 6 step lines and ended by 'budget_spent'"},
      {"finished after the whole budget", closing("end", "finished"), "means 1 to 4"},
      {"failed after more than the budget",
       [](Results& of) {
         Trial& trial = *of.of(kRival)[0];
         trial.closing["end"] = "failed";
         trial.steps.push_back(trial.steps.back());
         trial.steps.back()["step"] = 5;
       },
       "means at most 5"},
      {"step twice", [](Results& of) { of.of(kRival)[0]->steps[3]["step"] = 2; }, "has step 2 where 3 is due"},
      {"times of other steps", [](Results& of) { of.times[0]["algorithm_seconds"].erase(0); },
       "are of 4 steps, but it has 5"},
      {"no times", [](Results& of) { of.times.clear(); }, "8 trials lack their lines in times/"},
      // scores
      {"no score", last_step("recommended_mse", nullptr), "lacks 'recommended_mse' at step 4"},
      {"no score at the pose", last_step("commanded_mse", nullptr), "lacks 'commanded_mse' at step 4"},
      {"not measured", last_step("measured", nullptr), "lacks 'measured' at step 4"},
      {"score below zero", last_step("recommended_mse", -0.5), "has 'recommended_mse' -0.5 at step 4"},
      {"score above one", last_step("commanded_mse", 61), "has 'commanded_mse' 61 at step 4"},
      {"negative measurement", last_step("measured", -0.1), "has 'measured' -0.1 at step 4"},
      {"clock turned back", last_step("machine_seconds", 0.001), "has 'machine_seconds' 0.001 at step 4 after"},
      {"negative clock", [](Results& of) { of.of(kOwn)[0]->steps[0]["machine_seconds"] = -5; },
       "has 'machine_seconds' -5 at step 0"},
      {"recommendation before its step", last_step("recommended_seconds", 0.001),
       "; the move to the recommendation begins at"},
      {"recommendation without a time", last_step("recommended_seconds", nullptr), "has 'recommended_seconds' null"},
      {"rule of the recommendation", last_step("recommendation", "best"), "has the recommendation 'best' at step 4"},
      {"far below zero", last_step("recommended_mse", -9e-5), "below 0 by more than 10 standard errors"},
      {"no standard error", last_step("commanded_mse_error", nullptr), "with the standard error null"},
      {"negative standard error", last_step("recommended_mse_error", -1e-7), "with the standard error -1e-07"},
      {"huge standard error", last_step("recommended_mse_error", 1e300), "with the standard error 1e+300"},
      {"merit below the error", last_step("merit", 1e-9), "below the measured error, which it includes"},
      {"no merit", last_step("merit", nullptr), "has 'merit' null at step 4; a merit is a number from 0 to"},
      {"huge merit", last_step("merit", 1e308), "has 'merit' 1e+308 at step 4; a merit is a number from 0 to"},
      {"no clock", last_step("machine_seconds", nullptr), "has 'machine_seconds' null at step 4 after"},
      {"clock stands still",
       [](Results& of) {
         for (Json& step : of.of(kOwn)[0]->steps) step["machine_seconds"] = step["recommended_seconds"] = 0;
       },
       "has 'machine_seconds' 0 at step 1 after 0, but a step takes at least"},
      // poses
      {"pose of other axes", last_step("true_pose", {0.5}), "has 'true_pose' of 1 instead of"},
      {"pose without a value", [](Results& of) { of.of(kRival)[0]->steps.back()["commanded_pose"][0] = nullptr; },
       "has 'commanded_pose' with an unknown value at step 4"},
      {"pose outside the travel", [](Results& of) { of.of(kRival)[0]->steps.back()["true_pose"][0] = 1.5; },
       "has 'true_pose' outside the travel at step 4"},
      {"limit of no axis", last_step("limits_low", 4096), "at a limit of an axis that its scene does not have"},
      {"recommendation of another pose",
       [](Results& of) { of.of("random")[0]->steps.back()["recommended_pose"][0] = 0.123; },
       "but recommends another pose"},
      // trials of one instance
      {"own start pose",
       [](Results& of) {
         Json& start = of.of("home")[0]->steps[0];
         start["true_pose"][0] = start["recommended_true_pose"][0] = 0.51;
       },
       "starts with another 'true_pose' than"},
      {"own start", [](Results& of) { of.of(kOwn)[0]->steps[0]["measured"] = 0.009; },
       "starts with another 'measured' than"},
      {"score that its scene does not have",
       [](Results& of) {
         of.of(kRival)[0]->closing["best_mse"] = of.of(kRival)[0]->closing["best_mse_error"] = {0, 0, 0, 0, 0};
       },
       "has 'best_mse', which 7 other trials on this scene and noise level lack"},
      // members that no record has
      {"member of a step", last_step("score", 1), "it has 'score', which this version does not write"},
      {"member of a trial", closing("rank", 1), "it has 'rank', which this version does not write"},
      {"negative host time", [](Results& of) { of.times[0]["algorithm_seconds"][0] = -1; },
       "in times/ has 'algorithm_seconds' -1, which is not from 0 to 1e+09 s"},
      {"endless host time", [](Results& of) { of.times[0]["harness_seconds"] = 1e308; },
       "in times/ has 'harness_seconds' 1e+308, which is not from 0 to"},
      {"endless move", last_step("recommended_seconds", 1e308), "has 'recommended_seconds' 1e+308, which is not"},
      {"error before curing", closing("uncured_mse", -5), "has 'uncured_mse' -5; a mean squared error is from 0"},
      {"distance below 0", closing("pose_um", {0, 0, 0, 0, -5}), "has 'pose_um' -5 at step 4; it is from 0"},
      {"MTF above 1", closing("field_mtf_deficit", {0, 0, 0, 0, -2}), "has 'field_mtf_deficit' -2 at step 4"},
      {"MTF of the optimum above 1", closing("criterion_optimum_deficit", -2), "has 'criterion_optimum_deficit' -2"},
  };
  return all;
}

using CliForgeries = ForgedFolders;

TEST_F(CliForgeries, AcceptTheUnchangedFolder) {
  forge([](Results&) {});
  EXPECT_EQ(place_->read("forged/results/trials/0000.jsonl"), place_->read("good/results/trials/0000.jsonl"));
  const Outcome verified = call({"verify", "forged/results"});
  EXPECT_EQ(verified.exit_code, 0) << verified.err;
  EXPECT_THAT(verified.out, HasSubstr("checks     manifest, plan, trials, steps, scores, instances checked\n"));
  EXPECT_EQ(call({"report", "forged/results"}).exit_code, 0);
  EXPECT_THAT(place_->read("forged/results/report.html"),
              HasSubstr("manifest, plan, trials, steps, scores, instances checked"));
  EXPECT_THAT(call({"leaderboard", "build", "forged", "-o", "site"}).out, HasSubstr("evaluations  1 of 1"));
  EXPECT_THAT(place_->read("site/index.html"), HasSubstr("manifest, plan, trials, steps, scores, instances checked"));
  EXPECT_EQ(call({"merge", "forged/results", "-o", "merged"}).exit_code, 0);
  EXPECT_EQ(call({"verify", "merged", "--sample", "1"}).exit_code, 0);
}

TEST_F(CliForgeries, AreFoundByEveryCommand) {
  ASSERT_GE(forgeries().size(), 40U);
  for (const Forgery& forgery : forgeries()) {
    SCOPED_TRACE(forgery.name);
    forge(forgery.change);
    const Outcome verified = call({"verify", "forged/results", "--sample", "1"});
    EXPECT_NE(verified.exit_code, 0);
    EXPECT_THAT(verified.out + verified.err, HasSubstr(forgery.finding));

    const Outcome reported = call({"report", "forged/results", "--format", "md"});
    EXPECT_NE(reported.exit_code, 0);
    EXPECT_THAT(reported.err, HasSubstr(forgery.finding));
    // Either no report, or one that begins with what is wrong.
    EXPECT_THAT(reported.out.substr(0, 400), testing::AnyOf("", HasSubstr("do not rely on these results")));

    const Outcome built = call({"leaderboard", "build", "good", "forged", "-o", "site"});
    EXPECT_EQ(built.exit_code, 4);
    EXPECT_THAT(built.err, AllOf(HasSubstr("left out: 'forged'"), HasSubstr(forgery.finding)));
    EXPECT_THAT(built.out, HasSubstr("evaluations  1 of 2"));

    const Outcome merged = call({"merge", "forged/results", "-o", "merged"});
    EXPECT_EQ(merged.exit_code, 2);
    EXPECT_THAT(merged.err, HasSubstr(forgery.finding));
  }
}

TEST_F(CliForgeries, StandAtTheTopOfEveryReport) {
  forge(last_step("recommended_mse", nullptr));
  const std::string finding = "lacks 'recommended_mse' at step 4";
  const Outcome page = call({"report", "forged/results"});
  EXPECT_EQ(page.exit_code, 4);
  EXPECT_THAT(page.err, HasSubstr("warning: failed check: forged/results: scores: trial "));
  const std::string html = place_->read("forged/results/report.html");
  ASSERT_NE(html.find("lacks &#39;recommended_mse&#39; at step 4"), std::string::npos);
  EXPECT_LT(html.find("lacks &#39;recommended_mse&#39; at step 4"), html.find("<h2>Verdict</h2>"));
  const Outcome data = call({"report", "forged/results", "--format", "json"});
  EXPECT_EQ(data.exit_code, 4);
  bool found = false;
  const Json report = Json::parse(data.out);
  for (const Json& gate : report["results"][0]["gates"])
    found = found || (gate["name"] == "scores" && gate["ok"] == false &&
                      gate["text"].get<std::string>().find(finding) != std::string::npos);
  EXPECT_TRUE(found) << data.out;
  const Outcome both = call({"report", "good/results", "forged/results", "-o", "both.html"});
  EXPECT_EQ(both.exit_code, 4);
  EXPECT_THAT(both.err, HasSubstr(finding));
}

TEST_F(CliForgeries, ReportStatesWhichChecksNeedPlugins) {
  forge(of_rival("observes", {"images"}));
  const Outcome without = relign_bench(*place_, {"report", "forged/results"}, {{{"RELIGN_PLUGIN_PATH", ""}}});
  EXPECT_NE(without.exit_code, 0) << "the plugins beside the program are found";
  forge([](Results& of) {
    of.manifest["suite"] = Json({{"scenes", {"./mine.json"}},
                                 {"noise_levels", {"rho0"}},
                                 {"instances", 2},
                                 {"steps", 4},
                                 {"spec", {{"rmse", 0.01}}},
                                 {"algorithms", {"nlopt-sbplx", "nlopt-bobyqa"}}})
                               .dump();
  });
  const Outcome elsewhere = call({"report", "forged/results"});
  EXPECT_EQ(elsewhere.exit_code, 0) << elsewhere.err;
  EXPECT_THAT(place_->read("forged/results/report.html"), HasSubstr("checked, plan not ("));
}

TEST_F(CliForgeries, StartNoScriptOfTheFolder) {
  place_->write("theirs.py", "open('started', 'w')\n");
  forge([](Results& of) {
    change_suite(of, [](Json& suite) { suite["algorithms"].push_back("../theirs.py"); });
    of.manifest["suite_file"] = place_->path("forged/suite.json").string();
  });
  call({"report", "forged/results"});
  call({"leaderboard", "build", "good", "forged", "-o", "site"});
  call({"merge", "forged/results", "-o", "merged"});
  EXPECT_FALSE(fs::exists(place_->path("forged/started")));
  EXPECT_FALSE(fs::exists(place_->path("started")));
}

}  // namespace
}  // namespace relign::cli_test::forged
