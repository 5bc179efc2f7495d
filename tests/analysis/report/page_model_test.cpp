#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>

#include "base/error.h"
#include "base/files.h"
#include "error_text.h"
#include "records/checksum.h"
#include "report/made_results.h"
#include "report/page_json.h"
#include "report/report.h"
#include "report/verdict.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const fs::path kGolden = fs::path(RELIGN_TEST_DATA) / "report";

std::string all_text(const Json& list) {
  std::string text;
  for (const Json& item : list)
    text += (item.is_string() ? item.get<std::string>() : item["text"].get<std::string>()) + "\n";
  return text;
}

// The approved data of a small folder. After an intended change:
//   RELIGN_UPDATE_GOLDEN=1 ctest --test-dir build/release -R report_page_model
TEST(PageData, MatchesTheApprovedOne) {
  const Json data = to_json(page_model(load_results(kGolden / "small")));
  if (std::getenv("RELIGN_UPDATE_GOLDEN")) write_file_atomically(kGolden / "page_data.json", data.dump(1) + "\n");
  const Json approved = Json::parse(read_file(kGolden / "page_data.json"));
  EXPECT_TRUE(data == approved) << Json::diff(approved, data).dump(1);
}

// The same folder by hand: medians and quartiles of three round numbers.
TEST(PageData, MatchesHandCalculation) {
  const Json data = to_json(page_model(load_results(kGolden / "small")));
  ASSERT_EQ(data["groups"].size(), 2u);
  const Json& rho0 = data["groups"][0];
  EXPECT_EQ(rho0["instances"], 3);
  EXPECT_DOUBLE_EQ(rho0["start"].get<double>(), 0.08) << "median of 0.08, 0.06 and 0.1";
  EXPECT_EQ(rho0["rows"][0]["method"], "home");
  EXPECT_EQ(rho0["rows"][0]["oracle"], true);
  const Json& compass = rho0["rows"][1];
  EXPECT_EQ(compass["method"], "compass");
  EXPECT_DOUBLE_EQ(compass["recommended"]["median"].get<double>(), 0.02) << "of 0.02, 0.01, 0.04";
  EXPECT_DOUBLE_EQ(compass["recommended"]["q25"].get<double>(), 0.015);
  EXPECT_DOUBLE_EQ(compass["recommended"]["q75"].get<double>(), 0.03);
  EXPECT_DOUBLE_EQ(compass["machine_seconds"].get<double>(), 0.625) << "including the move to the recommended pose";
  const Json& track = rho0["curves"][1]["tracks"]["commanded"]["median"];
  EXPECT_EQ(track.size(), 3u);
  EXPECT_DOUBLE_EQ(track[2].get<double>(), 0.03) << "of 0.03, 0.02, 0.05";
  EXPECT_FALSE(rho0["curves"][1]["tracks"].contains("excess")) << "no own optimum, no excess";
}

TEST(PageData, CountsTrialsAndListsFailures) {
  const Json data = to_json(page_model(load_results(kGolden / "small")));
  const Json expected = {{"planned", 15}, {"finished", 12},        {"failed", 1},
                         {"missing", 2},  {"from_other_plans", 0}, {"incomplete", {"00000000000000ad"}}};
  EXPECT_EQ(data["ran"], expected);
  ASSERT_EQ(data["failures"].size(), 1u);
  EXPECT_EQ(data["failures"][0]["message"], "the stride became <NaN> & stayed so");
  EXPECT_EQ(data["failures"][0]["trials"][0]["steps"], 1);
  ASSERT_EQ(data["warnings"].size(), 1u);
  EXPECT_EQ(data["warnings"][0]["count"], 2);
}

TEST(PageData, VerdictExcludesOraclesAndHasCaveats) {
  const Json data = to_json(page_model(load_results(kGolden / "small")));
  EXPECT_EQ(data["verdict"][0]["best"], "compass") << "oracles are not ranked";
  EXPECT_THAT(all_text(data["verdict"]), HasSubstr("The oracle home, which is given the design pose, reaches 0.00400"));
  EXPECT_THAT(all_text(data["verdict"]), HasSubstr("1 of its 3 trials failed, excluded from the median"));
  const std::string caveats = all_text(data["caveats"]);
  EXPECT_THAT(caveats, HasSubstr("with only 3 instances intervals are wide"));
  EXPECT_THAT(caveats, HasSubstr("2 of 15 trials have not finished"));
  EXPECT_THAT(caveats, HasSubstr("home is an oracle"));
  EXPECT_THAT(caveats, HasSubstr("Not every method has finished the same instances"));
}

class Verdict : public MadeResults {
 protected:
  Json data() { return to_json(page_model(load_results(folder_))); }
};

TEST_F(Verdict, StatesBetterEqualAndUndecided) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 8; ++i) {
    const double lens = 0.01 * (1 + 0.1 * static_cast<double>(i));
    for (const char* level : {"rho0", "rho0.25", "rho0.5"}) trials.push_back(trial("a", i, {0.1, lens}, level));
    trials.push_back(trial("b", i, {0.1, 2 * lens}, "rho0"));
    trials.push_back(trial("b", i, {0.1, 1.001 * lens}, "rho0.25"));
    trials.push_back(trial("b", i, {0.1, (i % 2 == 0 ? 2 : 0.8) * lens}, "rho0.5"));
  }
  write(trials);
  const Json verdict = data()["verdict"];
  EXPECT_EQ(verdict[0]["text"],
            "a has the lowest median error, 0.0135 (95 % CI 0.0110 to 0.0160) over 8 instances; the median error at "
            "the start "
            "is 0.100. Second is b with 0.0270. a is better: paired by instance, the error of a is 0.50 times that of "
            "b (95 % "
            "CI 0.50 to 0.50).");
  EXPECT_THAT(
      verdict[1]["text"].get<std::string>(),
      HasSubstr("Second is b with the same median. The two are practically equal: paired by instance, the error "
                "of a is 1.00 times that of b"));
  EXPECT_THAT(verdict[2]["text"].get<std::string>(), HasSubstr("The comparison is undecided: "));
}

TEST_F(Verdict, IsUndecidedWithTwoInstances) {
  write({trial("a", 0, {0.1, 0.010}), trial("a", 1, {0.1, 0.012}), trial("b", 0, {0.1, 0.020}),
         trial("b", 1, {0.1, 0.022})});
  EXPECT_THAT(all_text(data()["verdict"]), HasSubstr("undecided"));
}

TEST_F(Verdict, StatesYieldAndInfeasibleInstances) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 4; ++i) {
    trials.push_back(trial("a", i, {0.1, i < 3 ? 0.01 : 0.05}));
    trials.back().own_optimum.mse = i < 3 ? 0 : 0.03 * 0.03;
  }
  write(trials);
  add_to_manifest({{"spec", {{"rmse", 0.02}}}});
  EXPECT_THAT(
      all_text(data()["verdict"]),
      HasSubstr("Yield: 3 of 4 instances (95 % CI 30 to 95 %) meet the specification (RMSE 0.0200), half of all "
                "instances after 2 images (the one at the start included) and 0.500 s of machine time."));
  EXPECT_THAT(all_text(data()["caveats"]),
              HasSubstr("rho0: 1 infeasible instance (instance 3): even the optimum misses the specification."));
}

TEST_F(Verdict, StatesInstancesThatLeftTheSpecification) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 4; ++i)
    trials.push_back(trial("a", i, {0.1, i < 3 ? 0.01 : 0.05, i < 1 ? 0.01 : 0.05}));
  write(trials);
  add_to_manifest({{"spec", {{"rmse", 0.02}}}});
  EXPECT_THAT(
      all_text(data()["verdict"]),
      HasSubstr("Yield: 1 of 4 instances (95 % CI 5 to 70 %) meet the specification (RMSE 0.0200); 3 met it at "
                "some step, half of all instances after 2 images (the one at the start included) and 0.500 s of "
                "machine time."));
}

TEST_F(Verdict, CountsTheImageAtTheStart) {
  write({trial("a", 0, {0.01, 0.01}), trial("a", 1, {0.01, 0.01})});
  add_to_manifest({{"spec", {{"rmse", 0.02}}}});
  EXPECT_THAT(all_text(data()["verdict"]), HasSubstr("half of all instances after 1 image (the one at the start)"));
}

TEST_F(Verdict, StatesTheHighestYield) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 4; ++i) {
    trials.push_back(trial("precise", i, {0.1, i < 3 ? 0.01 : 0.05}));
    trials.push_back(trial("steady", i, {0.1, 0.015}));
  }
  write(trials);
  add_to_manifest({{"spec", {{"rmse", 0.02}}}});
  EXPECT_THAT(all_text(data()["verdict"]), AllOf(HasSubstr("precise has the lowest median error"),
                                                 HasSubstr("The highest yield is that of steady: 4 of 4.")));
  write({trials[1], trials[3]});
  add_to_manifest({{"spec", {{"rmse", 0.02}}}});
  EXPECT_THAT(all_text(data()["verdict"]), Not(HasSubstr("The highest yield")));
}

TEST_F(Verdict, StatesTheSpecificationOfMtf) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 4; ++i) {
    trials.push_back(trial("a", i, {0.1, 0.01}));
    trials.back().scores.mtf[records::Rule::own][records::Curing::after] = {0.8, i < 2 ? 0.5 : 0.1};
    trials.back().own_optimum.mtf = {0.8, i < 3 ? 0.5 : 0.2};
  }
  write(trials);
  add_to_manifest({{"spec", {{"rmse", 0.02}, {"mtf", {{"lp_per_mm", 80}, {"centre", 0.5}, {"corner", 0.35}}}}}});
  const Json data = this->data();
  EXPECT_THAT(all_text(data["verdict"]),
              HasSubstr("Yield: 2 of 4 instances (95 % CI 15 to 85 %) meet the specification (RMSE 0.0200, MTF at 80.0 "
                        "lp/mm 0.500 in the centre and 0.350 in the corners)"));
  EXPECT_THAT(all_text(data["caveats"]), HasSubstr("1 infeasible instance (instance 3): neither the optimum nor the "
                                                   "final pose of any method meets the specification."));
  EXPECT_THAT(data["spec_text"].get<std::string>(),
              HasSubstr("0.350 in the corners at the final pose; MTF of the lens, geometric, evaluated"));
  const Json& row = data["groups"][0]["rows"][0];
  EXPECT_EQ(row["mtf"]["centre"]["median"], 0.8);
  EXPECT_EQ(row["mtf"]["corner"]["n"], 4);
  EXPECT_EQ(row["to_spec"]["successes"], 2);
  EXPECT_EQ(data["groups"][0]["spec_mtf"], (Json{{"lp_per_mm", 80}, {"centre", 0.5}, {"corner", 0.35}}));

  add_to_manifest({{"spec", {{"mtf", {{"lp_per_mm", 80}, {"corner", 0.35}}}}}});
  const Json alone = this->data();
  EXPECT_THAT(all_text(alone["verdict"]),
              HasSubstr("meet the specification (MTF at 80.0 lp/mm 0.350 in the corners)."));
  EXPECT_FALSE(alone["groups"][0]["rows"][0].contains("to_spec"));
  EXPECT_FALSE(alone["groups"][0].contains("spec_rmse"));
}

TEST_F(Verdict, StatesTheYieldBeforeCuring) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 4; ++i) {
    trials.push_back(trial("a", i, {0.1, i < 2 ? 0.01 : 0.03}));
    trials.back().scores.uncured_mse[records::Rule::own] = i < 3 ? 0.01 * 0.01 : 0.03 * 0.03;
    trials.back().scores.by_step[records::Rule::current] = {{0, 0}, {0, 0}};
  }
  write(trials);
  add_to_manifest({{"spec", {{"rmse", 0.02}}}});
  EXPECT_THAT(
      all_text(data()["verdict"]),
      HasSubstr("Yield: 2 of 4 instances (95 % CI 15 to 85 %) meet the specification (RMSE 0.0200), half of all "
                "instances after 2 images (the one at the start included) and 0.500 s of machine time; before curing 3 "
                "of 4."));
  const Json yield = data()["groups"][0]["rows"][0]["yield"];
  EXPECT_EQ(yield["uncured"]["in"], 3);
  EXPECT_EQ(yield["uncured"]["share"], 0.75);
}

TEST_F(Verdict, StatesTheBestPossibleScore) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 3; ++i) {
    trials.push_back(trial("a", i, {0.1, 0.01}));
    trials.back().own_optimum.mse = 0.002 * 0.002;
  }
  write(trials);
  const std::string words = "the median error at the start is 0.100, that of the instances' optima 0.00200.";
  EXPECT_THAT(all_text(data()["verdict"]), HasSubstr(words));
  const Report report(folder_);
  EXPECT_THAT(report.html(), HasSubstr("median error at the start 0.100 \u00b7 best possible 0.00200"));
  EXPECT_THAT(report.ranking_table(), HasSubstr("\n  best possible: 0.00200, the median of the instances' optima\n"));
  EXPECT_THAT(report.markdown(), HasSubstr("median error at the start: 0.100; best possible: 0.00200"));
  for (records::TrialRecord& one : trials) one.own_optimum.mse = 1e-12;
  std::filesystem::remove_all(folder_);
  write(trials);
  EXPECT_THAT(Report(folder_).ranking_table(), HasSubstr("best possible: <0.0001, ")) << "below the resolution";
  for (records::TrialRecord& one : trials) one.own_optimum.mse = std::numeric_limits<double>::quiet_NaN();
  std::filesystem::remove_all(folder_);
  write(trials);
  for (const std::string& text : {Report(folder_).html(), Report(folder_).markdown(), Report(folder_).ranking_table()})
    EXPECT_THAT(text, AllOf(Not(HasSubstr("best possible")), Not(HasSubstr("optima nan"))));
}

TEST_F(Verdict, SaysInTheHeadlineThatNoMethodImprovesOnTheStart) {
  const auto headline_of = [this](double last, double last_at_other_level) {
    std::filesystem::remove_all(folder_);
    write({trial("a", 0, {0.1, last}), trial("a", 0, {0.1, last_at_other_level}, "rho1"), trial("b", 0, {0.1, 0.4}),
           trial("b", 0, {0.1, 0.4}, "rho1")});
    return headline(page_model(load_results(folder_)));
  };
  EXPECT_EQ(headline_of(0.01, 0.02), "Lowest median error at both noise levels: a.");
  EXPECT_EQ(headline_of(0.2, 0.02),
            "No method improves on the median error at the start at 1 of 2 noise levels. Lowest median error at both "
            "noise levels: a.");
  EXPECT_EQ(headline_of(0.2, 0.3),
            "No method improves on the median error at the start at both noise levels. Lowest median error at both "
            "noise levels: a.");
  std::filesystem::remove_all(folder_);
  write({trial("a", 0, {0.1, 0.2}), trial("b", 0, {0.1, 0.4})});
  EXPECT_EQ(headline(page_model(load_results(folder_))),
            "No method improves on the median error at the start (0.100). Lowest median error: a.");
}

TEST_F(Verdict, HasNoIntervalForOneInstance) {
  write({trial("a", 0, {0.1, 0.01}), trial("b", 0, {0.1, 0.02})});
  EXPECT_THAT(all_text(data()["verdict"]), HasSubstr("on a single instance"));
  EXPECT_THAT(all_text(data()["verdict"]), Not(HasSubstr("quartile")));
  EXPECT_THAT(all_text(data()["caveats"]), HasSubstr("Results on a single instance do not generalise"));
}

TEST_F(Verdict, RanksNothingIfAllTrialsFailed) {
  records::TrialRecord failed = trial("a", 0, {0.1});
  failed.end = "failed";
  failed.message = "no";
  write({failed});
  EXPECT_EQ(data()["verdict"][0]["text"], "every trial failed; nothing can be ranked.");
  EXPECT_EQ(data()["verdict"][0]["best"], "");
}

TEST_F(Verdict, RanksByMeasuredErrorWithoutGroundTruth) {
  // The lowest measured error counts, not the last one.
  write({on_station("a", {0.2, 0.15}), on_station("b", {0.12, 0.3})});
  EXPECT_EQ(data()["verdict"][0]["best"], "b");
  EXPECT_THAT(all_text(data()["verdict"]),
              testing::AllOf(HasSubstr("lowest measured error, 0.120"), HasSubstr("Measured only")));
  EXPECT_THAT(all_text(data()["caveats"]), HasSubstr("True poses, noise-free errors"));
  EXPECT_EQ(data()["groups"][0]["measured_only"], true);
  EXPECT_EQ(data()["groups"][0]["rows"][0]["recommended"]["n"], 0);
  EXPECT_TRUE(data()["groups"][0]["curves"][0]["tracks"].contains("measured"));
  EXPECT_FALSE(data()["groups"][0]["curves"][0]["tracks"].contains("recommended"));
}

TEST_F(Verdict, StationsHaveNoNoiseLevelAndHideTheStart) {
  records::TrialRecord simulated = trial("a", 0, {0.1, 0.05});
  write({on_station("a", {0.2, 0.15}), simulated});
  add_to_manifest({{"suite", R"({"scenes": ["bench", "relign_od"]})"},
                   {"scenes", {{{"name", "bench"}, {"owns_stage", true}}, {{"name", "relign_od"}}}},
                   {"algorithms",
                    {{{"name", "a"}, {"protocol", "blind"}, {"observes", {"merit", "start"}}},
                     {{"name", "a"}, {"protocol", "paper"}, {"observes", {"merit", "start"}}}}}});
  const Json groups = data()["groups"];
  EXPECT_EQ(groups[0]["label"], "bench, blind");
  EXPECT_EQ(groups[0]["rows"][0]["observes"], Json({"merit"}));
  EXPECT_EQ(groups[1]["label"], "relign_od, rho0, paper");
  EXPECT_EQ(groups[1]["rows"][0]["observes"], Json({"merit", "start"}));
  EXPECT_EQ(data()["methods"][0]["observes"], Json({"merit", "start"})) << "the declaration is unchanged";
}

TEST_F(Verdict, GroupsEqualFailures) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 20; ++i) {
    trials.push_back(trial("a", i, {0.1}));
    trials.back().end = "failed";
    trials.back().message = i % 2 == 0 ? "even" : "odd";
  }
  write(trials);
  records::ResultsWriter(folder_).write_log(trials[2].trial, "what it printed\n");
  const Json failures = data()["failures"];
  ASSERT_EQ(failures.size(), 2u);
  EXPECT_EQ(failures[0]["count"], 10);
  EXPECT_EQ(failures[0]["trials"].size(), 5u);
  EXPECT_FALSE(failures[0]["trials"][0].contains("log")) << "nothing was printed";
  EXPECT_EQ(failures[0]["trials"][1]["log"], "logs/" + trials[2].trial + ".txt");
}

TEST_F(Verdict, HasTheHarnessOverheadPerStep) {
  write({trial("a", 0, {0.1, 0.05, 0.04}), trial("a", 1, {0.1, 0.05, 0.04}), trial("a", 2, {0.1, 0.05, 0.04})});
  std::string lines;
  for (std::uint64_t i = 0; i < 3; ++i) {
    records::TrialTimes times;
    times.trial = trial("a", i, {}).trial;
    times.algorithm_seconds = times.simulation_seconds = times.truth_seconds = {0.001, 0.001, 0.001};
    if (i > 0) times.harness_seconds = 30e-6;  // unknown of the first
    lines += records::with_checksum(to_line(times)) + "\n";
  }
  write_file_atomically(folder_ / "times" / "0000.jsonl", lines);
  const Json harness = data()["ran"]["harness"];
  EXPECT_DOUBLE_EQ(harness["microseconds_per_step"].get<double>(), 10);
  EXPECT_DOUBLE_EQ(harness["share_of_scene_time"].get<double>(), 0.005);
}

TEST_F(Verdict, ExcludesTrialsOfAnEarlierPlan) {
  write({trial("old", 0, {0.1, 0.001})});
  {
    const Json manifest = Json::parse(read_file(folder_ / "manifest.json"));
    Json changed = manifest;
    changed["order"] = {"0000000000000001"};
    changed["trials"] = 1;
    write_file_atomically(folder_ / "manifest.json", changed.dump());
  }
  EXPECT_EQ(data()["ran"]["from_other_plans"], 1);
  EXPECT_TRUE(data()["groups"].empty());
}

TEST_F(Verdict, RejectsFoldersWithoutResults) {
  const auto message = [&](const fs::path& folder) {
    try {
      page_model(load_results(folder));
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("(no error)");
  };
  EXPECT_THAT(message(folder_ / "missing"), HasSubstr("no such folder"));
  EXPECT_THAT(message(folder_), HasSubstr("is not a results folder"));
  write_file_atomically(folder_ / "manifest.json", "{\"format\": 99}");
  EXPECT_THAT(message(folder_), HasSubstr("newer"));
  write_file_atomically(folder_ / "manifest.json", "{\"format\": 1,");
  EXPECT_THAT(message(folder_), HasSubstr("invalid JSON at line 1, column 14"));
  write_file_atomically(folder_ / "manifest.json", "[]");
  EXPECT_THAT(message(folder_), HasSubstr("manifest.json"));
}

TEST_F(Verdict, RefusesADamagedManifest) {
  write({trial("a", 0, {0.1, 0.05})});
  Json manifest = Json::parse(read_file(folder_ / "manifest.json"));
  for (const char* key : {"suite_name", "program", "machine", "algorithms"})
    manifest[key] = Json::array({1, nullptr, {{"name", 3}}});
  manifest["humidity"] = 40;
  write_file_atomically(folder_ / "manifest.json", manifest.dump());
  EXPECT_THAT(test::error_text(ErrorKind::bad_input, [&] { data(); }),
              AllOf(HasSubstr("manifest.json is damaged: /program is [1,null,{\"name\":3}]; expected an object"),
                    HasSubstr("/suite_name is"), HasSubstr("/algorithms/1 is null; expected an object"),
                    HasSubstr("/algorithms/2/name is 3; expected text"), HasSubstr("/algorithms/2 lacks 'id'")));
}

TEST_F(Verdict, WritesTables) {
  write({trial("a", 0, {0.1, 0.05})});
  Report(folder_).write_tables();
  EXPECT_THAT(read_file(folder_ / "curves.csv"), HasSubstr("relign_od,rho0,paper,a,1,1,"));
  EXPECT_FALSE(Json::parse(read_file(folder_ / "curves.json")).empty());
  EXPECT_THAT(read_file(folder_ / "instances.csv"), HasSubstr("relign_od"));
}

TEST(Rounded, KeepsTheDigitsAskedFor) {
  EXPECT_EQ(rounded(0.0123456789, 5), 0.012346);
  EXPECT_EQ(rounded(123456.0, 3), 123000.0);
  EXPECT_EQ(rounded(0, 5), 0);
  EXPECT_TRUE(std::isnan(rounded(std::numeric_limits<double>::quiet_NaN(), 5)));
}

}  // namespace
}  // namespace relign::report
