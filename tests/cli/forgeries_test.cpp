// Forged results folders: a change to a good folder with correct checksums, and what each command finds without a
// replay.
#include <gmock/gmock.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "cli/program.h"
#include "records/checksum.h"

namespace relign::cli_test::forged {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;  // keeps the order of members, as the writer of records has it
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

struct Trial {
  std::vector<Json> steps;
  Json closing;
  std::string replace, by;  // a change of the text of the lines
  std::string text() const {
    std::string lines;
    for (const Json& step : steps) lines += step.dump() + "\n";
    Json last = closing;
    last["steps"] = steps.size();
    lines += last.dump();
    if (!replace.empty()) lines.replace(lines.find(replace), replace.size(), by);
    return records::with_checksum(lines) + "\n";
  }
};

// A results folder in memory.
struct Results {
  Json manifest;
  std::vector<Trial> trials;
  std::vector<Json> times;
  std::string replace, by;            // a change of the manifest's text
  std::string replace_time, by_time;  // of the first line of times

  std::vector<Trial*> of(const std::string& method) {
    std::vector<Trial*> found;
    for (Trial& trial : trials)
      if (trial.closing["algorithm"] == method) found.push_back(&trial);
    return found;
  }
  Json& method(const std::string& name) {
    for (Json& entry : manifest["algorithms"])
      if (entry["name"] == name) return entry;
    throw std::runtime_error("no method " + name);
  }
  Json suite() const { return Json::parse(manifest["suite"].get<std::string>()); }
};

Json without_checksum(const std::string& line) {
  Json read = Json::parse(line);
  read.erase("sha256");
  return read;
}

Results read_results(const Workplace& place, const std::string& folder) {
  Results results;
  results.manifest = Json::parse(place.read(folder + "/manifest.json"));
  std::istringstream lines(place.read(folder + "/trials/0000.jsonl")), times(place.read(folder + "/times/0000.jsonl"));
  Trial trial;
  for (std::string line; std::getline(lines, line);) {
    Json read = without_checksum(line);
    if (read.contains("end")) {
      trial.closing = std::move(read);
      results.trials.push_back(std::exchange(trial, {}));
    } else {
      trial.steps.push_back(std::move(read));
    }
  }
  for (std::string line; std::getline(times, line);) results.times.push_back(without_checksum(line));
  return results;
}

void write_results(const Workplace& place, const std::string& folder, const Results& results) {
  std::string manifest = results.manifest.dump(1), trials, times;
  if (!results.replace.empty()) manifest.replace(manifest.find(results.replace), results.replace.size(), results.by);
  for (const Trial& trial : results.trials) trials += trial.text();
  for (const Json& line : results.times) {
    std::string text = line.dump();
    if (times.empty() && !results.replace_time.empty())
      text.replace(text.find(results.replace_time), results.replace_time.size(), results.by_time);
    times += records::with_checksum(text) + "\n";
  }
  place.write(folder + "/manifest.json", manifest);
  place.write(folder + "/trials/0000.jsonl", trials);
  place.write(folder + "/times/0000.jsonl", times);
}

struct Forgery {
  const char* name;
  std::function<void(Results&)> change;
  std::string finding;  // that each command states
};

const std::string kRival = "nlopt-bobyqa", kOwn = "nlopt-sbplx";

void rename(Json& value, const std::string& from, const std::string& to) {
  if (value == from) value = to;
}

std::function<void(Results&)> manifest_member(const char* key, Json value) {
  return [key, value = std::move(value)](Results& results) { results.manifest[key] = value; };
}

std::function<void(Results&)> of_rival(const char* key, Json value) {
  return [key, value = std::move(value)](Results& results) { results.method(kRival)[key] = value; };
}

// Of the last step of the rival's first trial.
std::function<void(Results&)> last_step(const char* key, Json value) {
  return [key, value = std::move(value)](Results& results) { results.of(kRival)[0]->steps.back()[key] = value; };
}

std::function<void(Results&)> closing(const char* key, Json value) {
  return [key, value = std::move(value)](Results& results) { results.of(kRival)[0]->closing[key] = value; };
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
      {"spec removed", [](Results& of) { of.manifest.erase("spec"); },
       "'spec' is {\"rmse\":0.01} in the suite and null"},
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
      {"recommendation before its step", last_step("recommended_seconds", 0.001), "before the step itself"},
      {"rule of the recommendation", last_step("recommendation", "best"), "has the recommendation 'best' at step 4"},
      {"negative host time", [](Results& of) { of.times[0]["algorithm_seconds"][0] = -1; }, "are negative"},
  };
  return all;
}

class CliForgeries : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    place_ = new Workplace;
    evaluate("good", "gaussian_spot");
  }
  // A folder in which a method was submitted.
  static void evaluate(const std::string& folder, const std::string& scene) {
    const Json suite = {{"scenes", {scene}}, {"noise_levels", {"rho0"}}, {"instances", 2},
                        {"steps", 4},        {"spec", {{"rmse", 0.01}}}, {"algorithms", {kOwn, kRival}}};
    place_->write("tiny.json", suite.dump());
    const Outcome run = relign_bench(*place_, {"run", "tiny.json", "-o", folder + "/results"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const Json manifest = Json::parse(place_->read(folder + "/results/manifest.json"));
    Json methods = Json::array(), own;
    for (const Json& entry : manifest["algorithms"]) {
      methods.push_back({{"name", entry["name"]},
                         {"observes", entry["observes"]},
                         {"protocol", entry["protocol"]},
                         {"training", nullptr},
                         {"submitted", entry["name"] == kOwn}});
      if (entry["name"] == kOwn) own = methods.back();
    }
    place_->write(
        folder + "/evaluation.json",
        Json({{"format", "relign-bench/evaluation/1"},
              {"name", kOwn},
              {"version", "1.0"},
              {"archive_sha256", std::string(64, '0')},
              {"suite",
               {{"name", "tiny"}, {"sha256", std::string(64, '1')}, {"instance_set", manifest["instance_set"]}}},
              {"sealed", false},
              {"sandbox", false},
              {"date", "2026-11-24"},
              {"program_version", manifest["program"]["version"]},
              {"class", own["observes"]},
              {"budget", {{"steps", 4}}},
              {"methods", methods}})
            .dump());
    place_->write(folder + "/submission.json", Json({{"name", kOwn}, {"version", "1.0"}}).dump());
  }
  static void TearDownTestSuite() {
    delete place_;
    place_ = nullptr;
  }
  void TearDown() override { fs::remove_all(place_->path("forged")); }

  static void forge(const std::function<void(Results&)>& change, const std::string& from = "good") {
    fs::remove_all(place_->path("forged"));
    fs::copy(place_->path(from), place_->path("forged"), fs::copy_options::recursive);
    Results results = read_results(*place_, "forged/results");
    change(results);
    write_results(*place_, "forged/results", results);
  }
  static Outcome call(const std::vector<std::string>& arguments) { return relign_bench(*place_, arguments); }
  static inline Workplace* place_ = nullptr;
};

TEST_F(CliForgeries, AcceptTheUnchangedFolder) {
  forge([](Results&) {});
  EXPECT_EQ(place_->read("forged/results/trials/0000.jsonl"), place_->read("good/results/trials/0000.jsonl"));
  const Outcome verified = call({"verify", "forged/results"});
  EXPECT_EQ(verified.exit_code, 0) << verified.err;
  EXPECT_THAT(verified.out, HasSubstr("checks     manifest, plan, trials, steps, scores checked\n"));
  EXPECT_EQ(call({"report", "forged/results"}).exit_code, 0);
  EXPECT_THAT(place_->read("forged/results/report.html"), HasSubstr("manifest, plan, trials, steps, scores checked"));
  EXPECT_THAT(call({"leaderboard", "build", "forged", "-o", "site"}).out, HasSubstr("evaluations  1 of 1"));
  EXPECT_THAT(place_->read("site/index.html"), HasSubstr("manifest, plan, trials, steps, scores checked"));
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

TEST_F(CliForgeries, ReplaysCountForTheirRecordsOnly) {
  evaluate("lens", "relign_od");  // whose instances have an optimum, so that methods are ranked
  forge([](Results&) {}, "lens");
  const auto replayed = [](const std::string& method) {
    const Json feed = Json::parse(place_->read("site/feed.json"));
    for (const Json& of_class : feed["rounds"][0]["classes"])
      for (const Json& standing : of_class["methods"])
        if (standing["method"] == method) return standing["replayed"];
    return Json();
  };
  const auto build = [] { return call({"leaderboard", "build", "forged", "-o", "site"}); };
  ASSERT_EQ(build().exit_code, 0);
  EXPECT_EQ(replayed(kOwn), Json({{"by", nullptr}, {"of", 0}, {"trials", 0}}));
  EXPECT_THAT(place_->read("site/index.html"), HasSubstr("not replayed"));

  ASSERT_EQ(call({"verify", "forged/results", "--by", "A. Referee"}).exit_code, 0);
  ASSERT_EQ(build().exit_code, 0);
  EXPECT_EQ(replayed(kOwn)["trials"], 2);
  EXPECT_EQ(replayed(kRival)["of"], 2);
  EXPECT_THAT(replayed(kOwn)["by"].get<std::string>(), HasSubstr("by A. Referee with "));
  EXPECT_THAT(place_->read("site/index.html"), AllOf(HasSubstr("2 of 2"), HasSubstr("by A. Referee with ")));

  // Other records, with the same file beside them.
  const std::string stated = place_->read("forged/results/verify.json");
  const auto better = [](Results& of) { of.of(kOwn)[0]->steps.back()["recommended_mse"] = 1e-5; };
  forge(better, "lens");
  place_->write("forged/results/verify.json", stated);
  ASSERT_EQ(build().exit_code, 0);
  EXPECT_EQ(replayed(kOwn)["trials"], 0);

  // The file states that records differ.
  forge(better, "lens");
  EXPECT_EQ(call({"verify", "forged/results"}).exit_code, 4);
  EXPECT_THAT(build().err, HasSubstr("replay: 1 of 8 replayed trials gave different numbers"));
}

// Where a scene computes the optimum of its instances, a method without it would vanish from the ranking.
TEST_F(CliForgeries, MethodsDoNotVanish) {
  evaluate("lens", "relign_od");
  forge(closing("own_optimum_mse", nullptr), "lens");
  const Outcome built = call({"leaderboard", "build", "lens", "forged", "-o", "site"});
  EXPECT_EQ(built.exit_code, 4);
  EXPECT_THAT(built.err, HasSubstr("lacks 'own_optimum_mse', which 7 other trials on this scene have"));
}

}  // namespace
}  // namespace relign::cli_test::forged
