// Merits by field on the command line.
#include <gmock/gmock.h>

#include "cli/chart_scene.h"

namespace relign::cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

// With captures of little noise, which the narrow edges of the small image need.
constexpr const char* kScene = R"({"use": "chart.json", "parameters": {"sampler": "lattice", "samples": 64}})";

TEST(CliFieldMerit, TryShowsTheMeritThatTheAlgorithmObserves) {
  const Workplace place;
  place.write("chart.json", chart_scene().dump());
  std::vector<json> trials;
  for (const char* merit : {"mtf", "edge_energy", "rmse"}) {
    const Outcome outcome = relign_bench(
        place, {"--json", "try", "home", "--scene", kScene, "--noise-level", "rho0", "--steps", "2", "--merit", merit});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    trials.push_back(json::parse(outcome.out));
  }
  const auto merit = [&](std::size_t trial, std::size_t step) {
    return trials[trial].at("steps").at(step).at("merit").get<double>();
  };
  for (std::size_t step = 0; step < 2; ++step) {
    const json& rmse = trials[2].at("steps").at(step);
    EXPECT_EQ(merit(2, step), rmse.at("measured"));
    for (std::size_t trial = 0; trial < 2; ++trial) {
      EXPECT_EQ(trials[trial].at("steps").at(step).at("measured"), rmse.at("measured")) << "the same captures";
      EXPECT_NE(merit(trial, step), rmse.at("measured"));
      EXPECT_GE(merit(trial, step), 0);
      EXPECT_LE(merit(trial, step), 1);
    }
  }
  EXPECT_LT(merit(0, 1), merit(0, 0)) << "sharper at the nominal pose than at the start";
  EXPECT_LT(merit(1, 1), merit(1, 0));
}

TEST(CliFieldMerit, TryRefusesScenesWithoutFields) {
  const Workplace place;
  const Outcome outcome = relign_bench(place, {"try", "random", "--merit", "mtf", "--steps", "1"});
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("describes no 'fields'"));
}

TEST(CliFieldFocus, FailsOnScenesWithoutAChart) {
  const Workplace place;
  const Outcome outcome = relign_bench(place, {"try", "field-focus", "--scene", "gaussian_spot", "--steps", "2"});
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err + outcome.out, HasSubstr("the scene needs "));
  EXPECT_THAT(outcome.err + outcome.out, HasSubstr("such as camera_2mp"));
}

TEST(CliWindows, FitTheSensor) {
  const Workplace place;
  place.write("chart.json", chart_scene().dump());
  const Outcome outcome = relign_bench(
      place, {"try", "random", "--scene", R"({"use": "chart.json", "parameters": {"windows": 321}})", "--steps", "1"});
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("windows of 321 pixels do not fit the sensor of 480 x 320 pixels; at most 320"));
}

}  // namespace
}  // namespace relign::cli_test
