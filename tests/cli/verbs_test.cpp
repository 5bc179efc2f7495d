// try, validate, list, describe, render and report; JSON output; colours and terminals.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <regex>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::string kCompass =
    fs::path(RELIGN_PLUGIN_DIR).parent_path().parent_path().parent_path() / "out_of_tree/compass";

std::size_t count_lines(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

TEST(CliTry, PrintsOneRowPerStepAndWritesFrames) {
  const Workplace place;
  const Outcome outcome =
      relign_bench(place, {"try", "compass", "--plugin", kCompass, "--steps", "4", "--frames", "out"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(count_lines(outcome.out), 6U) << outcome.out;  // header, steps 0 to 4
  EXPECT_THAT(outcome.out, HasSubstr("recommended"));
  for (const char* frame : {"out/step-000.png", "out/step-004.png"})
    EXPECT_TRUE(fs::exists(place.path(frame))) << frame;
  EXPECT_FALSE(fs::exists(place.path("out/step-005.png")));
}

TEST(CliTry, RepeatsTheTrialOfASuite) {
  const Workplace place;
  place.write("suite.json", R"({"scenes": ["relign_od"], "noise_levels": ["rho0.5"], "instances": 2, "steps": 4,
                                "algorithms": ["nlopt-sbplx"]})");
  ASSERT_EQ(relign_bench(place, {"run", "suite.json"}).exit_code, 0);
  const Outcome outcome = relign_bench(
      place, {"try", "nlopt-sbplx", "--noise-level", "rho0.5", "--instance", "1", "--steps", "4", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json trial = json::parse(outcome.out);
  std::istringstream lines(place.read("results/suite/trials/0000.jsonl"));
  std::string line;
  std::vector<json> steps;
  bool found = false;
  while (!found && std::getline(lines, line)) {
    const json entry = json::parse(line);
    if (!entry.contains("end")) {
      steps.push_back(entry);
      continue;
    }
    found = entry.at("algorithm") == "nlopt-sbplx" && entry.at("instance") == 1;
    if (!found) steps.clear();
  }
  ASSERT_TRUE(found);
  ASSERT_EQ(steps.size(), trial.at("steps").size());
  for (std::size_t step = 0; step < steps.size(); ++step)
    for (const char* key : {"step", "true_pose", "merit", "measured", "commanded_mse", "recommended_mse"})
      EXPECT_EQ(steps[step].at(key), trial.at("steps")[step].at(key)) << step << " " << key;
}

TEST(CliTry, AcceptsParametersLikeASuite) {
  const Workplace place;
  json trials[2];
  const std::vector<std::string> uses[2] = {{"nlopt", "--parameters", R"({"method": "bobyqa"})"}, {"nlopt-bobyqa"}};
  for (int i = 0; i < 2; ++i) {
    std::vector<std::string> words = {"--json", "try", "--steps", "8"};
    words.insert(words.end(), uses[i].begin(), uses[i].end());
    const Outcome outcome = relign_bench(place, words);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    trials[i] = json::parse(outcome.out).at("steps");
  }
  const Outcome plain = relign_bench(place, {"--json", "try", "nlopt", "--steps", "8"});
  EXPECT_EQ(trials[0], trials[1]) << "a preset only sets parameters";
  EXPECT_NE(trials[0], json::parse(plain.out).at("steps"));
}

TEST(CliTry, BlindPosesAreRelativeToTheStart) {
  const Outcome outcome = relign_bench(Workplace(), {"try", "random", "--protocol", "blind", "--steps", "1", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out).at("steps")[0].at("commanded_pose"), json({0, 0, 0, 0, 0}));
}

TEST(CliValidate, CountsTrialsAndFramesAndEstimatesTime) {
  const Workplace place;
  place.write("tiny.json", kTinySuite);
  const Outcome plain = relign_bench(place, {"validate", "tiny.json"});
  ASSERT_EQ(plain.exit_code, 0) << plain.err;
  EXPECT_THAT(plain.out, HasSubstr("expected time"));
  const json result = json::parse(relign_bench(place, {"validate", "tiny.json", "--json"}).out);
  EXPECT_EQ(result.at("trials"), 12);
  EXPECT_EQ(result.at("frames"), 12 * 4);  // step 0 and three more
  EXPECT_GT(result.at("expected_seconds"), 0);
  EXPECT_FALSE(fs::exists(place.path("results")));
}

TEST(CliList, ListsKindsAndPresets) {
  const Workplace place;
  const Outcome all = relign_bench(place, {"list"});
  ASSERT_EQ(all.exit_code, 0) << all.err;
  EXPECT_EQ(all.err, "");
  for (const char* id : {"relign_od", "rho0.25", "rho0.25-package", "random", "home", "nlopt-bobyqa", "nlopt-cobyla"})
    EXPECT_THAT(all.out, HasSubstr(id));
  const Outcome levels = relign_bench(place, {"list", "noise_levels"});
  EXPECT_THAT(levels.out, AllOf(HasSubstr("rho0.5"), Not(HasSubstr("relign_od")), Not(HasSubstr("nlopt"))));
  for (const json& plugin : json::parse(relign_bench(place, {"list", "algorithms", "--json"}).out))
    EXPECT_THAT(plugin.at("kind"), testing::AnyOf("optimizer", "agent"));
}

TEST(CliDescribe, ShowsValuesOfPreset) {
  const Workplace place;
  const Outcome page = relign_bench(place, {"describe", "nlopt_bobyqa"});
  EXPECT_THAT(page.out,
              HasSubstr("relign-bench try nlopt-bobyqa --parameters '{\"first_stride\":0.1}'"));  // half of its own
  ASSERT_EQ(page.exit_code, 0) << page.err;
  EXPECT_THAT(page.out,
              AllOf(HasSubstr("preset of nlopt"), HasSubstr("merit, start, box"), HasSubstr("share of the travel")));
  const json described = json::parse(relign_bench(place, {"describe", "nlopt-bobyqa@1", "--json"}).out);
  const Outcome other = relign_bench(place, {"describe", "nlopt-bobyqa@2"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("'nlopt-bobyqa' has version 1 here"));
  std::map<std::string, json> values;
  for (const json& parameter : described.at("parameters")) values[parameter.at("name")] = parameter.at("value");
  EXPECT_EQ(values.at("method"), "bobyqa");
}

TEST(CliRender, DependsOnTheSeedOnly) {
  const Workplace place;
  const auto image = [&](const std::string& name, const std::string& seed) {
    const Outcome outcome = relign_bench(
        place, {"render", "--noise-level", "rho0.5", "--instance", "3", "--pose", "start", "--seed", seed, "-o", name});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(outcome.out, name + "\n");
    return place.read(name);
  };
  const std::string first = image("a.npy", "1");
  EXPECT_EQ(first.size(), 128U + 200 * 200 * sizeof(float));  // NumPy's header, then height x width float32
  EXPECT_EQ(first, image("b.npy", "1"));
  EXPECT_NE(first, image("c.npy", "2"));
}

TEST(CliRender, AveragesNoiseFreeImageToGivenError) {
  const Workplace place;
  place.write("tilted.json", R"({"elements": {"L3": {"tilt_deg": [2, 0], "shift_mm": [0, 0, 0]}}})");
  std::string stated;
  const auto image = [&](const std::string& name, std::vector<std::string> more) {
    more.insert(more.begin(), {"render", "--noise-free", "-o", name});
    const Outcome outcome = relign_bench(place, more);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    stated = outcome.err;
    return place.read(name);
  };
  const std::string plain = image("a.npy", {"--seed", "1"});
  EXPECT_THAT(stated, testing::MatchesRegex(
                          "standard error 0\\.000[12][0-9]* per pixel \\(root mean square over the image, in the unit "
                          "of RMSE; white is 0\\.[0-9]+\\), 1024 rays per pixel\n"));
  EXPECT_EQ(plain, image("b.npy", {"--seed", "1"}));
  EXPECT_NE(plain, image("b.npy", {"--seed", "2"}));
  EXPECT_NE(plain, image("c.npy", {"--seed", "1", "--assembly", "tilted.json"}));
  image("d.npy", {"--samples", "100"});
  EXPECT_THAT(stated, AllOf(HasSubstr("in the unit of RMSE"), HasSubstr("100 rays per pixel")));
  const Outcome listed = relign_bench(place, {"render", "--noise-free", "--samples", "100", "-o", "d.npy", "--json"});
  const json reached = json::parse(listed.out);
  EXPECT_EQ(reached["samples"], 100);
  const double error = reached["standard_error"];
  EXPECT_GT(error, 0);
  EXPECT_NEAR(std::stod(stated.substr(std::string("standard error ").size())), error, 0.05 * error) << stated;
  image("d.npy", {"--error", "0.00001"});
  EXPECT_THAT(stated, AllOf(HasSubstr("e-05, not 1e-05: stopped at"), HasSubstr("16384 rays per pixel")));
}

TEST(CliRender, RejectsErrorWithoutNoiseEstimate) {
  const Workplace place;
  const auto refused = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"render", "-o", "a.npy"});
    const Outcome outcome = relign_bench(place, more);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    return outcome.err;
  };
  EXPECT_THAT(refused({"--error", "0.001"}), HasSubstr("--error: requires --noise-free"));
  EXPECT_THAT(refused({"--noise-free", "--error", "0.001", "--samples", "9"}), HasSubstr("give one of them"));
  EXPECT_THAT(refused({"--noise-free", "--error", "0.001", "--scene", "gaussian_spot"}),
              HasSubstr("'gaussian_spot' does not report the error"));
}

TEST(CliVerbs, RewritesPageFromMovedFolder) {
  const Workplace place;
  place.write("tiny.json", kTinySuite);
  ASSERT_EQ(relign_bench(place, {"run", "tiny.json"}).exit_code, 0);
  const std::string page = place.read("results/tiny/report.html");
  fs::remove(place.path("results/tiny/report.html"));
  fs::remove(place.path("results/tiny/curves.csv"));
  fs::rename(place.path("results/tiny"), place.path("moved"));
  const Outcome outcome = relign_bench(place, {"report", "moved", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out).at("reports"), json({"moved/report.html"}));
  EXPECT_EQ(place.read("moved/report.html"), page);
  EXPECT_NE(place.read("moved/curves.csv"), "");

  const Outcome markdown = relign_bench(place, {"report", "moved", "--format", "md"});
  ASSERT_EQ(markdown.exit_code, 0) << markdown.err;
  EXPECT_THAT(markdown.out, HasSubstr("| method |"));
  const Outcome written = relign_bench(place, {"report", "moved", "--format", "md", "-o", "moved/table.md"});
  ASSERT_EQ(written.exit_code, 0) << written.err;
  EXPECT_EQ(written.out, "moved/table.md\n");
  EXPECT_EQ(place.read("moved/table.md"), markdown.out);
}

// The program's output on a terminal.
std::string on_a_terminal(const Workplace& place, const std::vector<std::string>& arguments,
                          std::map<std::string, std::string> environment) {
  const int ours = posix_openpt(O_RDWR | O_NOCTTY);
  if (ours < 0 || grantpt(ours) != 0 || unlockpt(ours) != 0) return "";
  const int theirs = open(ptsname(ours), O_RDWR | O_NOCTTY);
  environment["TERM"] = "xterm";
  relign_bench(place, arguments, {environment, theirs});
  close(theirs);
  std::string text;
  char buffer[4096];
  fcntl(ours, F_SETFL, O_NONBLOCK);
  for (ssize_t got = 0; (got = read(ours, buffer, sizeof buffer)) > 0;) text.append(buffer, got);
  close(ours);
  return text;
}

TEST(CliTerminal, HasColoursUnlessNoColorIsSet) {
  const Workplace place;
  const std::string coloured = on_a_terminal(place, {"try", "unknown"}, {});
  if (coloured.empty()) GTEST_SKIP() << "no pseudo-terminal here";
  EXPECT_THAT(coloured, HasSubstr("\033[31merror:"));
  EXPECT_THAT(on_a_terminal(place, {"try", "unknown"}, {{"NO_COLOR", "1"}}), Not(HasSubstr("\033")));
  EXPECT_THAT(relign_bench(place, {"try", "unknown"}).err, Not(HasSubstr("\033")));
}

TEST(CliTerminal, RepaintsProgressOnlyOnATerminal) {
  const Workplace place;
  place.write("longer.json", R"({"scenes": ["relign_od"], "noise_levels": ["rho0.25"],
                                 "algorithms": ["random"], "instances": 4, "steps": 10})");
  const std::string painted = on_a_terminal(place, {"run", "longer.json"}, {});
  if (painted.empty()) GTEST_SKIP() << "no pseudo-terminal here";
  EXPECT_THAT(painted, AllOf(HasSubstr("\r\033[K["), HasSubstr("of 8 trials")));
  const Outcome plain = relign_bench(place, {"run", "longer.json", "-o", "plain"});
  EXPECT_THAT(plain.err, AllOf(HasSubstr("trials: "), Not(HasSubstr("\r"))));
}

}  // namespace
}  // namespace relign::cli_test
