// A specification with an MTF on the command line: measured, scored and reported; rejected if a scene has no MTF.
#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kSuite =
    R"({"name": "mtf", "scenes": [{"use": "relign_od", "name": "od", "parameters": {"pixels": 40}}],
  "noise_levels": ["rho0.5"], "instances": 4, "steps": 2, "algorithms": ["home", "random"],
  "spec": {"rmse": 0.2, "mtf": {"lp_per_mm": 10, "centre": 0.5, "corner": 0.4}}})";

TEST(CliMtfSpec, CountsInstancesThatMeetIt) {
  const Workplace place;
  place.write("suite.json", kSuite);
  const Outcome outcome = relign_bench(place, {"run", "suite.json", "--workers", "2"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::set<std::string> in_spec;
  std::size_t trials = 0;
  std::istringstream lines(place.read("results/mtf/trials/0000.jsonl"));
  for (std::string line; std::getline(lines, line);) {
    const json closing = json::parse(line);
    if (!closing.contains("end")) {
      EXPECT_FALSE(closing.contains("mtf_centre")) << "not measured at steps";
      continue;
    }
    ++trials;
    for (const char* key : {"mtf_centre", "mtf_corner", "own_optimum_mtf_centre", "own_optimum_mtf_corner"}) {
      EXPECT_GE(closing.at(key), 0) << key;
      EXPECT_LE(closing.at(key), 1) << key;
    }
    EXPECT_FALSE(closing.contains("uncured_mtf_centre")) << "no cure shift here";
    if (closing["mtf_centre"] >= 0.5 && closing["mtf_corner"] >= 0.4) in_spec.insert(closing["trial"]);
  }
  EXPECT_EQ(trials, 8U);
  EXPECT_GT(in_spec.size(), 0U);
  EXPECT_LT(in_spec.size(), trials);
  const json report = json::parse(relign_bench(place, {"report", "results/mtf", "--format", "json"}).out);
  const json& group = report.at("results").at(0).at("groups").at(0);
  EXPECT_EQ(group.at("spec_mtf").at("lp_per_mm"), 10);
  std::size_t counted = 0;
  for (const json& row : group.at("rows")) {
    counted += row.at("yield").at("in").get<std::size_t>();
    EXPECT_EQ(row.at("mtf").at("corner").at("n"), 4);
    EXPECT_LE(row.at("to_spec").at("successes"), row.at("yield").at("in"));
  }
  EXPECT_EQ(counted, in_spec.size()) << "the error is in spec at nearly any pose, the MTF decides";
  const std::string page = place.read("results/mtf/report.html");
  EXPECT_THAT(page, HasSubstr("MTF at 10.0 lp/mm 0.500 in the centre and 0.400 in the corners"));
  EXPECT_THAT(page, HasSubstr("centre / corner, median"));
  EXPECT_THAT(place.read("results/mtf/instances.csv"), HasSubstr(",message,mtf_centre,mtf_corner,"));
  const Outcome verified = relign_bench(place, {"verify", "results/mtf", "--sample", "2"});
  EXPECT_EQ(verified.exit_code, 0);
  EXPECT_THAT(verified.out, HasSubstr("the others were not replayed"));

  // Other limits reuse the same trials.
  json suite = json::parse(kSuite);
  suite["spec"]["mtf"]["centre"] = 0.9;
  place.write("suite.json", suite.dump());
  EXPECT_EQ(json::parse(relign_bench(place, {"--json", "run", "suite.json"}).out).at("reused"), 8);
}

TEST(CliMtfSpec, IncludesDiffractionIfTheSceneDoes) {
  const Workplace place;
  const std::string folder = std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system/relign_od/";
  json scene = json::parse(std::ifstream(folder + "scene.json"));
  scene["lens"] = folder + "lens.json";
  scene["sensor"]["pixels"] = 40;
  scene["spec"] = {{"mtf", {{"lp_per_mm", 10}, {"centre", 0.5}, {"corner", 0.4}, {"diffraction", true}}}};
  place.write("scene.json", scene.dump());
  json suite = json::parse(kSuite);
  suite["scenes"] = {"scene.json"};
  suite["instances"] = 1;
  suite.erase("spec");
  place.write("suite.json", suite.dump());
  const Outcome valid = relign_bench(place, {"validate", "suite.json"});
  EXPECT_THAT(valid.out, HasSubstr("centre 0.800, corner 0.897 (with diffraction)")) << valid.err;
  ASSERT_EQ(relign_bench(place, {"run", "suite.json"}).exit_code, 0);
  EXPECT_THAT(place.read("results/mtf/report.html"), HasSubstr("with diffraction, evaluated once at the end"));
  // The suite may set the limits, but not the kind of MTF.
  suite["spec"] = {{"mtf", {{"lp_per_mm", 10}, {"diffraction", false}}}};
  place.write("suite.json", suite.dump());
  const Outcome other = relign_bench(place, {"validate", "suite.json"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("requires an MTF without diffraction, but that of the scene"));
  suite["spec"]["mtf"].erase("diffraction");
  place.write("suite.json", suite.dump());
  EXPECT_THAT(relign_bench(place, {"validate", "suite.json"}).out, HasSubstr("(with diffraction)"));
}

TEST(CliMtfSpec, AddsNothingToRecordsWithoutIt) {
  const Workplace place;
  json suite = json::parse(kSuite);
  suite["spec"].erase("mtf");
  suite["instances"] = 1;
  place.write("suite.json", suite.dump());
  ASSERT_EQ(relign_bench(place, {"run", "suite.json"}).exit_code, 0);
  EXPECT_THAT(place.read("results/mtf/trials/0000.jsonl"), Not(HasSubstr("mtf")));
  EXPECT_THAT(place.read("results/mtf/instances.csv"), Not(HasSubstr("mtf_")));
}

TEST(CliMtfSpec, RejectsScenesWithoutMtf) {
  const Workplace place;
  json suite = json::parse(kSuite);
  suite["scenes"] = {"relign_od", "gaussian_spot"};
  suite["noise_levels"] = {"rho0"};
  place.write("suite.json", suite.dump());
  for (const char* verb : {"validate", "run"}) {
    const Outcome outcome = relign_bench(place, {verb, "suite.json"});
    EXPECT_EQ(outcome.exit_code, 2) << verb;
    EXPECT_THAT(outcome.err,
                HasSubstr("the suite's 'spec' requires the MTF at 10 lp/mm, which is unavailable for the scene "
                          "'gaussian_spot': it does not offer it; remove 'mtf' from"))
        << verb;
    EXPECT_THAT(outcome.err, Not(HasSubstr("'relign_od'"))) << verb;
  }
  suite["scenes"] = {"relign_od"};
  place.write("suite.json", suite.dump());
  const Outcome valid = relign_bench(place, {"validate", "suite.json"});
  EXPECT_EQ(valid.exit_code, 0) << valid.err;
  EXPECT_THAT(valid.out, HasSubstr("relign_od as designed, at its nominal pose: centre 0.8"));
  suite["spec"]["mtf"]["lp_per_mm"] = 0;
  place.write("suite.json", suite.dump());
  const Outcome zero = relign_bench(place, {"validate", "suite.json"});
  EXPECT_EQ(zero.exit_code, 2);
  EXPECT_THAT(zero.err, HasSubstr("lp_per_mm"));
}

}  // namespace
}  // namespace relign::cli_test
