// Recommendation rules, classes, methods of several protocols and the analysis plan on the page.
#include <gmock/gmock.h>

#include <map>
#include <set>

#include "base/error.h"
#include "base/json_members.h"
#include "error_text.h"
#include "report/made_results.h"
#include "report/page_json.h"
#include "report/report.h"
#include "report/rules_data.h"
#include "report/statistics_data.h"
#include "report/text_tables.h"

namespace relign::report {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class Rules : public MadeResults {
 protected:
  Json data(std::optional<statistics::Rule> rule = std::nullopt) {
    const LoadedResults results = load_results(folder_);
    return to_json(page_model(results, statistics::make_study(results.trials, study_options(results, rule))));
  }

  // "model" recommends a pose that it has not visited, "walker" one that it has measured. By `own` the model is far
  // better; at visited poses the two are equal.
  static std::vector<records::TrialRecord> model_and_walker() {
    std::vector<records::TrialRecord> trials;
    for (std::uint64_t i = 0; i < 8; ++i) {
      const double lens = 0.02 * (1 + 0.05 * static_cast<double>(i));
      trials.push_back(trial("walker", i, {0.1, lens, 2 * lens}));
      trials.back().steps[2].recommended_mse = lens * lens;
      trials.push_back(trial("model", i, {0.1, lens, 3 * lens}));
      trials.back().steps[2].recommended_mse = lens * lens / 4;
    }
    return trials;
  }
  static Json row(const Json& group, const std::string& method) {
    for (const Json& one : group["rows"])
      if (one["method"] == method) return one;
    return nullptr;
  }
};

TEST_F(Rules, EachRuleScoresItsPose) {
  write(model_and_walker());
  const Json group = data()["groups"][0];
  const double lens = 0.02 * 1.175;  // median of eight
  EXPECT_NEAR(row(group, "model")["rules"]["own"]["median"], lens / 2, 1e-12);
  EXPECT_NEAR(row(group, "model")["rules"]["best"]["median"], lens, 1e-12) << "step 1 has the lowest measured error";
  EXPECT_NEAR(row(group, "model")["rules"]["current"]["median"], 3 * lens, 1e-12);
  EXPECT_NEAR(row(group, "walker")["rules"]["current"]["median"], 2 * lens, 1e-12);
  EXPECT_EQ(group["rules"]["own"]["pairs"][0]["verdict"], "better");
  EXPECT_EQ(group["rules"]["best"]["pairs"][0]["verdict"], "practically equal");
  EXPECT_EQ(group["rules"]["current"]["pairs"][0]["a"], "walker");
}

TEST_F(Rules, TheChosenRuleDeterminesThePage) {
  write(model_and_walker());
  const Json by_own = data(), by_current = data(statistics::Rule::current);
  EXPECT_EQ(by_own["rule"], "own");
  EXPECT_EQ(by_own["verdict"][0]["best"], "model");
  EXPECT_EQ(by_current["rule"], "current");
  EXPECT_EQ(by_current["verdict"][0]["best"], "walker");
  EXPECT_EQ(by_current["groups"][0]["rows"][0]["recommended"]["median"],
            row(by_own["groups"][0], "walker")["rules"]["current"]["median"]);
  EXPECT_EQ(by_current["groups"][0]["pairs"], by_own["groups"][0]["rules"]["current"]["pairs"]);
}

TEST_F(Rules, YieldDependsOnTheRule) {
  write(model_and_walker());
  add_to_manifest({{"spec", {{"rmse", 0.0255}}}});
  const Json of_model = row(data()["groups"][0], "model");
  EXPECT_EQ(of_model["rules"]["own"]["yield"]["in"], 8);
  EXPECT_EQ(of_model["rules"]["best"]["yield"]["in"], 6) << "0.02 to 0.0255";
  EXPECT_EQ(of_model["rules"]["current"]["yield"]["in"], 0);
  EXPECT_EQ(of_model["rules"]["current"]["steps"], 1) << "it met the specification and left it again";
  EXPECT_EQ(row(data(statistics::Rule::best)["groups"][0], "model")["yield"]["in"], 6);
}

TEST_F(Rules, NotesVerdictsThatDependOnTheRule) {
  write(model_and_walker());
  EXPECT_THAT(
      text_of(data(), "rules_note"),
      AllOf(HasSubstr("The verdict depends on the recommendation rule. rho0: merit: model by own (better than walker)"),
            HasSubstr("walker by current (better than model)")));
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 8; ++i) {
    trials.push_back(trial("a", i, {0.1, 0.01}));
    trials.push_back(trial("b", i, {0.1, 0.02}));
  }
  std::filesystem::remove_all(folder_);
  write(trials);
  EXPECT_THAT(text_of(data(), "rules_note"), HasSubstr("No verdict depends on the recommendation rule"));
}

TEST_F(Rules, FollowYieldWhereItIsThePrimaryMeasure) {
  write(model_and_walker());
  add_plan({{"primary", "yield"}, {"rule", "own"}}, {{"spec", {{"rmse", 0.0255}}}});
  const std::string note = text_of(data(), "rules_note");
  EXPECT_THAT(note,
              HasSubstr("rho0: merit: model by own (8 of 8), model and walker by best (6 of 8), model and walker by "
                        "current (0 of 8)."));
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 8; ++i) {
    trials.push_back(trial("a", i, {0.1, 0.02}));
    trials.push_back(trial("b", i, {0.1, i < 7 ? 0.01 : 0.1}));
  }
  std::filesystem::remove_all(folder_);
  write(trials);
  add_plan({{"primary", "yield"}, {"rule", "own"}}, {{"spec", {{"rmse", 0.0255}}}});
  EXPECT_THAT(text_of(data(), "rules_note"), HasSubstr("the same method of each class has the highest yield."));
  const std::string table = markdown_tables(Report(folder_).model());
  EXPECT_LT(table.find("| a |"), table.find("| b |")) << "whose median is lower";
}

TEST_F(Rules, AreScoredAfterCuring) {
  std::vector<records::TrialRecord> trials = model_and_walker();
  for (records::TrialRecord& one : trials) {
    one.scores.uncured_mse[statistics::Rule::own] = 1e-4;
    one.scores.by_step[statistics::Rule::current].mse = {1e-2, 4e-4, 9e-4};
    one.scores.by_step[statistics::Rule::current].error = {0, 0, 0};
  }
  write(trials);
  const Json complete = data(statistics::Rule::best);
  EXPECT_NEAR(complete["groups"][0]["rows"][0]["recommended"]["median"], 0.02, 1e-12);
  EXPECT_NEAR(row(complete["groups"][0], "model")["rules"]["current"]["median"], 0.03, 1e-12);
}

TEST_F(Rules, ThePageShowsAllRules) {
  write(model_and_walker());
  const std::string page = Report(folder_, statistics::Rule::best).html();
  EXPECT_THAT(page, HasSubstr("Recommendation rules"));
  EXPECT_THAT(page, HasSubstr("The verdict depends on the recommendation rule"));
  EXPECT_THAT(page, HasSubstr("at the pose with the lowest measured error"));
  EXPECT_THAT(Report(folder_, statistics::Rule::best).ranking_table(),
              HasSubstr("the pose with the lowest measured error"));
  EXPECT_THAT(Report(folder_, statistics::Rule::best).markdown(), HasSubstr("depends on the recommendation rule"));
}

Json method(const std::string& name, const std::string& protocol, const Json& observed, bool oracle = false) {
  return {{"name", name},     {"id", name},          {"protocol", protocol},        {"observes", observed},
          {"oracle", oracle}, {"merit", "combined"}, {"parameters", Json::object()}};
}

class Protocols : public Rules {
 protected:
  void write_both(bool blind_first) {
    std::vector<records::TrialRecord> trials;
    for (std::uint64_t i = 0; i < 2; ++i)
      for (const char* name : {"home", "random"}) {
        trials.push_back(trial(name, i, {0.1, name[0] == 'h' ? 0.01 : 0.05}));
        trials.push_back(trials.back());
        trials.back().protocol = "blind";
        trials.back().trial = short_id("blind" + trials.back().trial);
      }
    write(trials);
    Json algorithms = Json::array();
    for (const bool blind : {blind_first, !blind_first})
      for (const char* name : {"home", "random"})
        algorithms.push_back(method(name, blind ? "blind" : "paper", Json::array({name[0] == 'h' ? "start" : "merit"}),
                                    blind && name[0] == 'h'));
    add_to_manifest({{"algorithms", algorithms}});
  }
};

TEST_F(Protocols, OraclesDependOnTheProtocol) {
  for (const bool blind_first : {false, true}) {
    std::filesystem::remove_all(folder_);
    write_both(blind_first);
    const Json found = data();
    ASSERT_EQ(found["groups"].size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) {
      const bool blind = found["groups"][i]["protocol"] == "blind";
      EXPECT_EQ(row(found["groups"][i], "home")["oracle"], blind) << blind_first;
      EXPECT_EQ(found["verdict"][i]["best"], blind ? "random" : "home") << "oracles are not ranked";
    }
    ASSERT_EQ(found["methods"].size(), 4U);
    std::set<std::string> labels, keys;
    for (const Json& one : found["methods"]) {
      labels.insert(one["label"]);
      keys.insert(one["key"]);
    }
    EXPECT_THAT(labels, testing::ElementsAre("home (blind)", "home (paper)", "random (blind)", "random (paper)"));
    EXPECT_EQ(keys.size(), 4U);
  }
}

TEST_F(Protocols, KeysDifferByParametersAndMerit) {
  write({trial("a", 0, {0.1, 0.01})});
  std::set<Json> keys;
  for (const Json& other : {Json(Json::object()), Json{{"merit", "rmse"}}, Json{{"parameters", {{"stride", 2}}}}}) {
    Json one = method("a", "paper", {"merit"});
    one.update(other);
    add_to_manifest({{"algorithms", Json::array({one})}});
    keys.insert(data()["groups"][0]["rows"][0]["key"]);
  }
  EXPECT_EQ(keys.size(), 3U);
}

TEST_F(Rules, RanksWithinObservationClasses) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 8; ++i)
    for (const auto& [name, error] :
         std::map<std::string, double>{{"agent", 0.01}, {"fit", 0.005}, {"search", 0.03}, {"slow", 0.04}})
      trials.push_back(trial(name, i, {0.1, error}));
  write(trials);
  add_to_manifest({{"algorithms",
                    {method("agent", "paper", {"images"}), method("fit", "paper", {"images", "design"}),
                     method("search", "paper", {"merit", "start"}), method("slow", "paper", {"merit", "start"})}}});
  const Json found = data();
  EXPECT_EQ(row(found["groups"][0], "fit")["class"], "images and design");
  const Json& classes = found["verdict"][0]["classes"];
  ASSERT_EQ(classes.size(), 3U);
  EXPECT_EQ(classes[0]["class"], "merit");
  EXPECT_EQ(classes[0]["best"], "search");
  EXPECT_THAT(text_of(classes[0], "text"),
              HasSubstr("search is better: paired by instance, the error of search is 0.75 times that of slow"));
  EXPECT_EQ(classes[1]["best"], "agent");
  EXPECT_THAT(text_of(classes[1], "text"), HasSubstr("No other method of this class"));
  const std::string page = Report(folder_).html();
  EXPECT_LT(page.find("Methods that observe the merit alone"), page.find("Methods that observe images and the design"));
  EXPECT_THAT(ranking_csv_rows(Report(folder_).model(), "x"), HasSubstr(",images and design,combined,"));
}

TEST_F(Rules, FollowsTheAnalysisPlan) {
  write(model_and_walker());
  const Json plan = {{"primary", "yield"},
                     {"rule", "best"},
                     {"contrasts", Json::array({Json::array({"walker", "model"})})},
                     {"smallest_relevant_ratio", 1.5},
                     {"yield", 0.9}};
  add_plan(plan, {{"spec", {{"rmse", 0.0255}}}});
  const std::string hash = sha256_hex(canonical_json(plan));
  const Json found = data();
  EXPECT_EQ(found["rule"], "best");
  EXPECT_EQ(found["smallest_relevant_ratio"], 1.5);
  EXPECT_EQ(found["analysis"]["hash"], hash);
  EXPECT_TRUE(found["analysis_notes"].empty());
  const Json& pair = found["groups"][0]["pairs"][0];
  EXPECT_EQ(pair["planned"], true);
  EXPECT_EQ(pair["p_planned"], pair["p"]) << "one contrast";
  EXPECT_EQ(pair["yields"],
            Json({{"n", 8}, {"a", 6}, {"b", 6}, {"a_alone", 0}, {"b_alone", 0}, {"p", 1.0}, {"p_planned", 1.0}}));
  EXPECT_THAT(data(statistics::Rule::own)["analysis_notes"][0].get<std::string>(),
              HasSubstr("uses the rule 'own', the analysis plan the rule 'best'"));
  const std::string page = Report(folder_).html();
  EXPECT_THAT(page, HasSubstr("Analysis plan (" + hash.substr(0, 16) + ")"));
  EXPECT_THAT(page, HasSubstr("undecided: in specification 6 and 6 of 8 instances"));
  EXPECT_THAT(found["verdict"].dump(), HasSubstr(" has the highest yield: 6 of 8 instances"));
  EXPECT_THAT(found["verdict"].dump(), testing::Not(HasSubstr("lowest median error"))) << "not the primary measure";
  EXPECT_THAT(page, HasSubstr("undecided, since the 95 % interval contains 90.0 %"));
}

TEST_F(Rules, ReportsAChangedPlan) {
  write(model_and_walker());
  EXPECT_FALSE(data().contains("analysis")) << "no plan";
  add_plan({{"primary", "rmse"}, {"rule", "own"}}, {{"analysis_began_with", std::string(64, 'b')}});
  EXPECT_THAT(data()["analysis_notes"][0].get<std::string>(), HasSubstr("changed after the first trials had ended"));
  add_to_manifest({{"analysis_began_with", "none"}});
  EXPECT_THAT(Report(folder_).html(), HasSubstr("written after the first trials had ended"));
}

}  // namespace
}  // namespace relign::report
