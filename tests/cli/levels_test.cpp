// Noise levels on the command line and in suites: tolerance files, objects, and levels that do not fit a scene.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

std::string limits(const std::string& element) {
  return R"({"use": "tolerances",
 "elements": {")" +
         element + R"(": {"shift_um": [10, 10, 5], "tilt_arcmin": [3, 3], "pivot": "own_front"}},
 "start": {"shift_um": [200, 200, 100], "tilt_arcmin": [30, 30]}, "movement": {"cross_talk": 0.01}})";
}

TEST(CliLevels, AcceptsToleranceFilesInSuitesAndOptions) {
  const Workplace place;
  place.write("my_lens/tolerances.json", limits("L3"));
  place.write("suite.json", R"({"scenes": ["relign_od"], "algorithms": ["home"], "instances": 2, "steps": 1,
                                "noise_levels": ["my_lens/tolerances.json", "tolerances-precision"]})");
  ASSERT_EQ(relign_bench(place, {"validate", "suite.json"}).exit_code, 0);
  const Outcome run = relign_bench(place, {"run", "suite.json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("tolerances"), HasSubstr("tolerances-precision")));

  const std::vector<std::string> home = {"try", "home", "--steps", "1", "--json", "--noise-level"};
  const auto tried = [&](const std::string& level) {
    std::vector<std::string> arguments = home;
    arguments.push_back(level);
    const Outcome outcome = relign_bench(place, arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.exit_code == 0 ? json::parse(outcome.out) : json();
  };
  const json mine = tried("my_lens/tolerances.json");
  // Start poses depend on seed and limits only, so a level with equal limits has the same start; element offsets
  // differ.
  const json grade = tried("tolerances-precision");
  EXPECT_EQ(mine.at("steps").at(0).at("true_pose"), grade.at("steps").at(0).at("true_pose"));
  EXPECT_NE(mine.at("steps").at(1).at("measured"), grade.at("steps").at(1).at("measured"));
}

TEST(CliLevels, WarnsOfMethodsThatUseAHistoryWithoutBatches) {
  const Workplace place;
  place.write("suite.json", R"({"scenes": ["gaussian_spot"], "algorithms": ["aim-off"], "instances": 1, "steps": 1,
                                "noise_levels": ["rho0"]})");
  const char* const warning =
      "'aim-off' has no effect of its own at the noise level 'rho0', whose modules have no "
      "history: it has no 'batch'";
  for (const char* verb : {"validate", "run"}) {
    const Outcome outcome = relign_bench(place, {verb, "suite.json"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::size_t first = outcome.err.find(warning);
    ASSERT_NE(first, std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err.find(warning, first + 1), std::string::npos) << "once";
  }
}

TEST(CliLevels, AcceptsObjectsInOptions) {
  const Workplace place;
  const auto steps = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"--json", "try", "home", "--steps", "1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = relign_bench(place, arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.exit_code == 0 ? json::parse(outcome.out).at("steps") : json();
  };
  const json named = steps({"--noise-level", "rho0.5"});
  EXPECT_EQ(steps({"--noise-level", R"({"use": "rho", "name": "half", "parameters": {"level": 0.5}})"}), named);
  EXPECT_EQ(steps({"--noise-level", R"({"use": "rho0.5"})"}), named);
  EXPECT_NE(steps({"--noise-level", R"({"use": "rho", "parameters": {"level": 0.75}})"}), named);
  EXPECT_NE(steps({"--noise-level", "rho0.5", "--scene", R"({"use": "relign_od", "parameters": {"samples": 16}})"}),
            named);
}

TEST(CliLevels, ReportsPlaceOfUnknownElementForEveryVerb) {
  const Workplace place;
  place.write("limits.json", limits("L9"));
  place.write("suite.json", R"({"scenes": ["relign_od", "gaussian_spot"], "algorithms": ["home"], "instances": 2,
                                "noise_levels": ["limits.json", "rho0.25"]})");
  const auto wrong = AllOf(HasSubstr("noise level 'limits' cannot be used with scene 'relign_od'"),
                           HasSubstr("limits.json:2:21: /elements/L9: the scene has no element 'L9'"));
  const std::vector<std::vector<std::string>> commands = {{"validate", "suite.json"},
                                                          {"run", "suite.json"},
                                                          {"try", "home", "--noise-level", "limits.json"},
                                                          {"render", "--noise-level", "limits.json", "-o", "a.png"}};
  for (const auto& command : commands) {
    SCOPED_TRACE(command.front());
    const Outcome outcome = relign_bench(place, command);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, wrong);
    if (command.back() != "suite.json") continue;
    // All pairs of the suite that do not fit are reported at once.
    EXPECT_THAT(outcome.err, AllOf(HasSubstr("'limits' cannot be used with scene 'gaussian_spot'"),
                                   HasSubstr("'rho0.25' cannot be used with scene 'gaussian_spot'"),
                                   HasSubstr("use rho0, which has no offsets")));
  }
}

TEST(CliLevels, AcceptsLevelsWithoutOffsetsForGaussianSpot) {
  const Workplace place;
  const Outcome tried = relign_bench(place, {"try", "random", "--scene", "gaussian_spot", "--steps", "3"});
  EXPECT_EQ(tried.exit_code, 0) << tried.err;
  place.write("toy.json", R"({"use": "tolerances", "elements": {},
    "start": {"shift_um": [200, 200, 100, 100], "tilt_arcmin": [600]}, "movement": {"cross_talk": 0.01}})");
  place.write("suite.json", R"({"scenes": ["gaussian_spot"], "noise_levels": ["rho0", "none", "toy.json"],
                                "algorithms": ["nlopt-sbplx"], "instances": 5, "steps": 40})");
  ASSERT_EQ(relign_bench(place, {"validate", "suite.json"}).exit_code, 0);
  const Outcome run = relign_bench(place, {"run", "suite.json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  // A perfect lens on a perfect stage, started at the optimum: the noise-free error is exactly 0.
  const Outcome perfect = relign_bench(
      place, {"try", "home", "--scene", "gaussian_spot", "--noise-level", "none", "--steps", "1", "--json"});
  ASSERT_EQ(perfect.exit_code, 0) << perfect.err;
  EXPECT_EQ(json::parse(perfect.out).at("steps").at(1).at("commanded_mse"), 0);
}

}  // namespace
}  // namespace relign::cli_test
