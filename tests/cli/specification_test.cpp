// A specification by field and pose on the command line: judged after every step, reported, refused where impossible.
#include <gmock/gmock.h>

#include <map>
#include <sstream>

#include "cli/chart_scene.h"

namespace relign::cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

json chart_suite() {
  return {{"name", "spec"},
          {"scenes", {"chart.json"}},
          {"noise_levels", {"tolerances-precision"}},
          {"instances", 2},
          {"steps", 3},
          {"algorithms", {"home", "random"}},
          {"spec",
           {{"field_mtf",
             {{"lp_per_mm", 20},
              {"tangential", 0.3},
              {"sagittal", 0.3},
              {"fields", {{{"name", "centre"}, {"tangential", 0.5}}, "left", "right"}}}},
            {"centre_px", 20},
            {"rotation_px", 2},
            {"pose_um", 60},
            {"tilt_arcmin", 20}}}};
}

TEST(CliSpecification, IsJudgedAfterEveryStep) {
  const Workplace place;
  place.write("chart.json", chart_scene().dump());
  place.write("suite.json", chart_suite().dump());
  const Outcome outcome = relign_bench(place, {"run", "suite.json", "--workers", "2"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream lines(place.read("results/spec/trials/0000.jsonl"));
  std::map<std::uint64_t, json> optima;
  std::size_t closings = 0;
  for (std::string line; std::getline(lines, line);) {
    const json closing = json::parse(line);
    if (!closing.contains("end")) continue;
    ++closings;
    for (const char* key : {"field_mtf_deficit", "centre_px", "rotation_px", "pose_um", "tilt_arcmin"})
      EXPECT_EQ(closing.at(key).size(), closing.at("steps")) << key;
    const json& pose = closing.at("criterion_optimum_pose");
    EXPECT_EQ(optima.emplace(closing.at("instance"), pose).first->second, pose) << "one optimum per instance";
    EXPECT_LE(closing.at("criterion_optimum_deficit"), closing.at("field_mtf_deficit").back());
    if (closing.at("algorithm") == "home") {
      EXPECT_LT(closing.at("field_mtf_deficit").back(), closing.at("field_mtf_deficit").front());
    }
  }
  EXPECT_EQ(closings, 4U);
  const json report = json::parse(relign_bench(place, {"report", "results/spec", "--format", "json"}).out);
  const json& group = report.at("results").at(0).at("groups").at(0);
  EXPECT_EQ(group.at("spec_criteria").at("pose_um"), 60);
  for (const json& row : group.at("rows")) {
    const json& criteria = row.at("to_specification");
    EXPECT_EQ(criteria.size(), 6U);
    EXPECT_EQ(criteria.back().at("criterion"), "all");
    EXPECT_EQ(criteria.back().at("share").at("in"), row.at("yield").at("in"));
    for (const json& criterion : criteria)
      EXPECT_GE(criterion.at("share").at("in"), criteria.back().at("share").at("in"));
  }
  const std::string page = place.read("results/spec/report.html");
  EXPECT_THAT(page, HasSubstr("To specification"));
  EXPECT_THAT(page, HasSubstr("MTF by field at 20.0 lp/mm"));
  EXPECT_EQ(relign_bench(place, {"verify", "results/spec"}).exit_code, 0);

  // A limit in micrometres is judged anew from the same trials, one of MTF is not.
  json suite = chart_suite();
  suite["spec"]["pose_um"] = 1;
  place.write("suite.json", suite.dump());
  EXPECT_EQ(json::parse(relign_bench(place, {"--json", "run", "suite.json"}).out).at("reused"), 4);
}

TEST(CliSpecification, NamesWhatAnOptimumNeedsNoFieldsFor) {
  const Workplace place;
  json suite = chart_suite();
  suite["scenes"] = json::array(
      {json{{"use", "relign_od"}, {"name", "small"}, {"parameters", {{"pixels", 40}, {"rotation_z", true}}}}});
  suite["noise_levels"] = {"rho0.25"};
  suite["instances"] = 1;
  suite["spec"] = {{"pose_um", 100}, {"tilt_arcmin", 100}};
  place.write("suite.json", suite.dump());
  ASSERT_EQ(relign_bench(place, {"run", "suite.json"}).exit_code, 0);
  const std::string trials = place.read("results/spec/trials/0000.jsonl");
  EXPECT_THAT(trials, HasSubstr("\"tilt_arcmin\""));
  EXPECT_THAT(trials, Not(HasSubstr("criterion_optimum")));
  const json report = json::parse(relign_bench(place, {"report", "results/spec", "--format", "json"}).out);
  for (const json& row : report.at("results").at(0).at("groups").at(0).at("rows"))
    EXPECT_EQ(row.at("residual").at("axes").size(), 5U) << "not the rotation of a round lens about its axis";
}

TEST(CliSpecification, RefusesWhatTheSceneCannotJudge) {
  const Workplace place;
  place.write("chart.json", chart_scene().dump());
  const auto message = [&](const json& spec, const char* scene) {
    json suite = chart_suite();
    suite["spec"] = spec;
    suite["scenes"] = {scene};
    suite["noise_levels"] = {"rho0"};
    place.write("suite.json", suite.dump());
    const Outcome outcome = relign_bench(place, {"validate", "suite.json"});
    EXPECT_EQ(outcome.exit_code, 2);
    return outcome.err;
  };
  const json mtf = {{"lp_per_mm", 20}, {"tangential", 0.3}};
  EXPECT_THAT(message({{"field_mtf", mtf}}, "relign_od"), HasSubstr("need its 'fields'"));
  EXPECT_THAT(message({{"pose_um", 2}}, "gaussian_spot"), HasSubstr("cannot be judged on the scene 'gaussian_spot'"));
  json unknown = mtf;
  unknown["fields"] = {"middle"};
  EXPECT_THAT(message({{"field_mtf", unknown}}, "chart.json"),
              HasSubstr("unknown field 'middle'; fields of the scene"));
  json twice = mtf;
  twice["fields"] = {"centre", {{"name", "centre"}, {"tangential", 0.9}}};
  EXPECT_THAT(message({{"field_mtf", twice}}, "chart.json"),
              testing::MatchesRegex(
                  "(.|\n)*suite.json:[0-9]+:[0-9]+: /spec/field_mtf/fields/1: duplicate field 'centre', already listed "
                  "at line [0-9]+, column [0-9]+\n"));
  EXPECT_THAT(message({{"field_mtf", {{"lp_per_mm", 20}}}}, "chart.json"), HasSubstr("expected a limit"));
  EXPECT_THAT(message({{"centre_px", -1}}, "chart.json"), HasSubstr("centre_px"));
}

TEST(CliSpecification, RefusesRulesWithoutYieldsAndCosts) {
  const Workplace place;
  place.write("chart.json", chart_scene().dump());
  const auto validated = [&](const json& analysis, const json& cost) {
    json suite = chart_suite();
    suite["analysis"] = analysis;
    if (!cost.is_null()) suite["cost"] = cost;
    place.write("suite.json", suite.dump(1));
    return relign_bench(place, {"validate", "suite.json"});
  };
  const Outcome yield = validated({{"primary", "yield"}, {"rule", "best"}}, json());
  EXPECT_EQ(yield.exit_code, 2);
  EXPECT_THAT(yield.err,
              testing::ContainsRegex("suite.json:[0-9]+:[0-9]+: /analysis/rule: found 'best', must be 'own'"));
  const Outcome priced = validated({{"rule", "current"}}, {{"station_per_hour", 60}});
  EXPECT_EQ(priced.exit_code, 2);
  EXPECT_THAT(priced.err, HasSubstr("/analysis/rule: found 'current', must be 'own': 'cost' is known"));
  EXPECT_EQ(validated({{"rule", "best"}}, json()).exit_code, 0) << "errors are known by every rule";
  EXPECT_EQ(validated({{"primary", "yield"}}, {{"station_per_hour", 60}}).exit_code, 0);
}

TEST(CliSpecification, NamesTheKindOfMtfAndFrequenciesBeyondTheSensor) {
  const Workplace place;
  json scene = chart_scene();
  scene.erase("spec");
  place.write("chart.json", scene.dump());
  json suite = chart_suite();
  suite["spec"] = {{"field_mtf", {{"lp_per_mm", 50}, {"tangential", 0.1}}}};
  suite["instances"] = suite["steps"] = 1;
  place.write("suite.json", suite.dump());
  const Outcome validated = relign_bench(place, {"validate", "suite.json"});
  EXPECT_THAT(validated.out, HasSubstr("at 50.0 lp/mm: geometric MTF (no diffraction)"));
  const char* const warning = "'field_mtf' is at 50 lp/mm, above the Nyquist frequency of the sensor, 41.67 lp/mm";
  EXPECT_THAT(validated.err, HasSubstr(warning));
  EXPECT_THAT(relign_bench(place, {"run", "suite.json"}).err, HasSubstr(warning));
  EXPECT_THAT(place.read("results/spec/report.html"), HasSubstr("at the final pose; geometric MTF (no diffraction)"));

  scene["spec"] = {{"mtf", {{"lp_per_mm", 20}, {"diffraction", true}}}};
  // Of one field: diffraction takes its time for each.
  scene["fields"] = {{{"name", "centre"}, {"tangential", {{"x", 240}, {"y", 140}, {"width", 40}, {"height", 40}}}}};
  place.write("chart.json", scene.dump());
  suite["spec"]["field_mtf"]["lp_per_mm"] = 40;
  place.write("suite.json", suite.dump());
  const Outcome diffracted = relign_bench(place, {"validate", "suite.json"});
  EXPECT_THAT(diffracted.out, HasSubstr("at 40.0 lp/mm: MTF with diffraction"));
  EXPECT_THAT(diffracted.err, Not(HasSubstr("Nyquist")));
}

}  // namespace
}  // namespace relign::cli_test
