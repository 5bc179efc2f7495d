// lens draw, scene landscape and render --animate.
#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

// True once the running program has reported progress.
bool has_begun(const Workplace& place) {
  for (const auto& entry : std::filesystem::directory_iterator(place.folder()))
    if (place.read(entry.path().filename()).find("\"doing\"") != std::string::npos) return true;
  return false;
}

TEST(CliLensDraw, DrawsLensOfSceneWithRays) {
  const Workplace place;
  const Outcome outcome = relign_bench(place, {"lens", "draw", "--fields", "0,20,42", "--rays", "5", "-o", "lens.svg"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "lens.svg\n");
  const std::string svg = place.read("lens.svg");
  EXPECT_THAT(svg, StartsWith("<svg xmlns="));
  EXPECT_EQ(count_of(svg, "<g class=\"rays\">"), 3U);
  EXPECT_EQ(count_of(svg, "<g class=\"element\">"), 4U);
  for (const char* word : {"42 deg", "aperture stop", ">L4<", "sensor", "object 115.3 mm", " mm</text>"})
    EXPECT_THAT(svg, HasSubstr(word));
}

TEST(CliLensDraw, DrawsLensFileAndAssembly) {
  const Workplace place;
  const std::string lens = std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system/relign_od/lens.json";
  ASSERT_EQ(relign_bench(place, {"lens", "draw", lens, "-o", "perfect.svg"}).exit_code, 0);
  EXPECT_THAT(place.read("perfect.svg"), HasSubstr("object far away"));
  place.write("built.json", R"({"elements": {"L2": {"tilt_deg": [3, 0]}}})");
  ASSERT_EQ(relign_bench(place, {"lens", "draw", lens, "--assembly", "built.json", "-o", "built.svg"}).exit_code, 0);
  EXPECT_NE(place.read("built.svg"), place.read("perfect.svg"));
  const Outcome png = relign_bench(place, {"lens", "draw", lens, "--vertical", "-o", "lens.png", "--json"});
  ASSERT_EQ(png.exit_code, 0) << png.err;
  EXPECT_EQ(json::parse(png.out).at("fields").at(0).at("rays"), 7);
  EXPECT_THAT(place.read("lens.png"), StartsWith("\x89PNG"));
}

// The derivatives point from an image to that at a pose a little farther along the axis.
TEST(CliRender, WritesDerivativesByEachAxis) {
  const Workplace place;
  const Outcome outcome = relign_bench(place, {"render", "--pose", "0.5,0.5,0.5,0.5,0.5", "--derivatives", "--samples",
                                               "64", "-o", "star.npy", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result.at("samples"), 64);
  ASSERT_EQ(result.at("derivatives").size(), 5U);
  const json& x = result.at("derivatives").at(0);
  EXPECT_EQ(x.at("axis"), "x");
  EXPECT_EQ(x.at("image"), "star-x.npy");
  EXPECT_GT(x.at("largest").get<double>(), 0.1);
  ASSERT_EQ(relign_bench(place, {"render", "--pose", "0.51,0.5,0.5,0.5,0.5", "--noise-free", "--samples", "64", "-o",
                                 "moved.npy"})
                .exit_code,
            0);
  const auto floats = [&](const std::string& name) {
    const std::string text = place.read(name);
    std::vector<float> values(200 * 200);
    std::memcpy(values.data(), text.data() + text.size() - 4 * values.size(), 4 * values.size());
    return values;
  };
  const std::vector<float> star = floats("star.npy"), moved = floats("moved.npy"), slope = floats("star-x.npy");
  double along = 0, squares = 0;
  for (std::size_t i = 0; i < star.size(); ++i) {
    along += static_cast<double>(moved[i] - star[i]) * static_cast<double>(slope[i]);
    squares += static_cast<double>(slope[i]) * static_cast<double>(slope[i]);
  }
  EXPECT_NEAR(along / squares, 0.01, 0.002);
}

TEST(CliRender, SaysWhereThereAreNoDerivatives) {
  const Workplace place;
  for (const std::vector<std::string>& given :
       {std::vector<std::string>{"--transport", "ghost"}, {"--scene", "gaussian_spot"}}) {
    std::vector<std::string> arguments = {"render", "--derivatives", "--samples", "4"};
    arguments.insert(arguments.end(), given.begin(), given.end());
    const Outcome outcome = relign_bench(place, arguments);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, HasSubstr("--derivatives: the images of scene"));
  }
  EXPECT_THAT(relign_bench(place, {"render", "--derivatives", "--error", "0.1"}).err, HasSubstr("use --samples"));
  EXPECT_THAT(relign_bench(place, {"render", "--derivatives", "--samples", "9999999"}).err,
              HasSubstr("at most 1048576"));
}

TEST(CliLensDraw, ReportsInvalidInput) {
  const Workplace place;
  const Outcome ending = relign_bench(place, {"lens", "draw", "-o", "lens.jpg"});
  EXPECT_EQ(ending.exit_code, 2);
  EXPECT_THAT(ending.err, HasSubstr("must end in .svg or .png"));
  EXPECT_EQ(relign_bench(place, {"lens", "draw", "x.json", "--scene", "relign_od"}).exit_code, 2);
  EXPECT_EQ(relign_bench(place, {"lens", "draw", "none.json"}).exit_code, 2);
  EXPECT_THAT(relign_bench(place, {"lens", "draw", "--fields", "95"}).err, HasSubstr("95 is outside -89 to 89"));
  place.write("built.json", R"({"elements": {"L9": {}}})");
  EXPECT_THAT(relign_bench(place, {"lens", "draw", "--assembly", "built.json"}).err, HasSubstr("unknown element 'L9'"));
  // A field without rays is reported.
  const Outcome dark = relign_bench(place, {"lens", "draw", "--fields", "0,85"});
  EXPECT_EQ(dark.exit_code, 0);
  EXPECT_THAT(dark.err, HasSubstr("no ray at field angle 85 deg passes"));
}

TEST(CliLandscape, WritesPicturePageAndTable) {
  const Workplace place;
  const Outcome outcome = relign_bench(
      place, {"scene", "landscape", "--scene", "gaussian_spot", "--points", "5", "-o", "maps", "--progress", "json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "maps/landscape.png\nmaps/landscape.html\nmaps/landscape.csv\n");
  EXPECT_THAT(place.read("maps/landscape.png"), StartsWith("\x89PNG"));
  EXPECT_EQ(count_of(place.read("maps/landscape.html"), "<g class=\"panel\">"), 10U);
  EXPECT_EQ(count_of(place.read("maps/landscape.csv"), "\n"), 1U + 10 * 25);
  // The last line of progress counts every pose.
  const std::string last = outcome.err.substr(outcome.err.rfind("\n{", outcome.err.size() - 2) + 1);
  EXPECT_EQ(json::parse(last).at("done"), 250) << outcome.err;
  EXPECT_EQ(json::parse(last).at("total"), 250);
}

TEST(CliLandscape, IsLowestAtNominalPoseOfPerfectLens) {
  const Workplace place;
  const Outcome outcome =
      relign_bench(place, {"scene", "landscape", "--points", "3", "-o", "map.csv", "--json", "--progress", "none"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(json::parse(outcome.out).at("files"), json::array({"map.csv"}));
  // The nominal pose is the centre of every plane; the perfect lens has no error there.
  std::istringstream table(place.read("map.csv"));
  std::size_t middles = 0;
  for (std::string line; std::getline(table, line);) {
    const bool middle = line.find(",0,0,0.5,0.5,") != std::string::npos;
    if (line.find("axis") == 0) continue;
    const double rmse = std::stod(line.substr(line.rfind(',') + 1));
    if (middle) ++middles;
    if (middle)
      EXPECT_LT(rmse, 1e-3) << line;
    else
      EXPECT_GT(rmse, 5e-3) << line;
  }
  EXPECT_EQ(middles, 10U);
}

// On a small travel, where the MSE is nearly a parabola between neighbours: 2.8 % off, by their third derivatives and
// rays.
TEST(CliLandscape, GradientsAreDifferencesOfTheError) {
  const Workplace place;
  const std::string folder = std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system/relign_od/";
  json near = json::parse(std::ifstream(folder + "scene.json"));
  near["lens"] = folder + "lens.json";
  near["travel"] = {{"shift_mm", {0.04, 0.04, 0.1}}, {"tilt_deg", {0.28, 0.28}}};
  place.write("near.json", near.dump());
  const Outcome outcome =
      relign_bench(place, {"scene", "landscape", "--scene", "near.json", "--noise-level", "rho0.5", "--points", "5",
                           "--arrows", "-o", "maps", "--json", "--progress", "none"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(place.read("maps/landscape.html"), HasSubstr("towards lower values"));
  std::istringstream table(place.read("maps/landscape.csv"));
  std::string line;
  std::getline(table, line);
  ASSERT_THAT(line, testing::EndsWith(",RMSE,gradient_1,gradient_2"));
  std::vector<std::vector<std::string>> rows;
  while (std::getline(table, line)) {
    std::istringstream cells(line + ",");
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  ASSERT_EQ(rows.size(), 10U * 25);
  std::size_t arrows = 0;
  double errors = 0, squares = 0;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    if (rows[row][9].empty()) continue;
    ++arrows;
    const auto rmse = [&](std::size_t at) { return std::stod(rows[at][8]); };
    for (const auto& [cell, step] : {std::pair<std::size_t, std::size_t>{9, 1}, {10, 5}}) {
      const double difference = (std::pow(rmse(row + step), 2) - std::pow(rmse(row - step), 2)) / 0.5;  // of the travel
      errors += std::pow(2 * rmse(row) * std::stod(rows[row][cell]) - difference, 2);
      squares += difference * difference;
    }
  }
  EXPECT_EQ(arrows, 10U * 9);
  EXPECT_LT(std::sqrt(errors / squares), 0.06);
}

TEST(CliLandscape, SaysWhereThereAreNoDerivatives) {
  const Workplace place;
  for (const char* scene : {"gaussian_spot", R"({"use": "relign_od", "parameters": {"transport": "ghost"}})"}) {
    const Outcome outcome = relign_bench(place, {"scene", "landscape", "--scene", scene, "--arrows", "-o", "maps"});
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, HasSubstr("--arrows: the RMSE of scene"));
    EXPECT_THAT(outcome.err, HasSubstr("or leave out --arrows"));
    EXPECT_FALSE(std::filesystem::exists(place.path("maps")));
  }
}

TEST(CliLandscape, ReportsInvalidInputAndStopsOnCtrlC) {
  const Workplace place;
  EXPECT_THAT(relign_bench(place, {"scene", "landscape", "-o", "map.svg"}).err,
              HasSubstr("ends in .png, .html or .csv"));
  const Outcome start = relign_bench(place, {"scene", "landscape", "--scene", "gaussian_spot", "--pose", "start"});
  EXPECT_EQ(start.exit_code, 2);
  EXPECT_THAT(start.err, HasSubstr("only an instance has a start"));
  Running running(place, {RELIGN_PROGRAM, "scene", "landscape", "--scene", "gaussian_spot", "--points", "501", "-o",
                          "map.csv", "--progress", "json"});
  while (!has_begun(place) && !running.ended()) usleep(20000);
  running.send(SIGINT);
  const Outcome stopped = running.wait();
  EXPECT_EQ(stopped.exit_code, 130);
  EXPECT_THAT(stopped.err, HasSubstr("poses; nothing was written"));
  EXPECT_FALSE(std::filesystem::exists(place.path("map.csv")));
}

TEST(CliAnimate, WritesGifAlongPath) {
  const Workplace place;
  const Outcome outcome =
      relign_bench(place, {"render", "--scene", "gaussian_spot", "--animate", "0.3,0.5,0.5,0.5,0.5->nominal",
                           "--frames", "5", "-o", "a.gif", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(place.read("a.gif"), StartsWith("GIF89a"));
  const json result = json::parse(outcome.out);
  ASSERT_EQ(result.at("frames"), 5);
  EXPECT_DOUBLE_EQ(result.at("poses").at(1).at(0).get<double>(), 0.35);
  EXPECT_EQ(result.at("poses").at(4), json::array({0.5, 0.5, 0.5, 0.5, 0.5}));
  // The same from a file of poses.
  place.write("path.json", R"({"poses": [[0.3, 0.5, 0.5, 0.5, 0.5], "nominal"]})");
  ASSERT_EQ(relign_bench(
                place, {"render", "--scene", "gaussian_spot", "--animate", "path.json", "--frames", "5", "-o", "b.gif"})
                .exit_code,
            0);
  EXPECT_EQ(place.read("a.gif"), place.read("b.gif"));
}

TEST(CliAnimate, WritesVideoWithFfmpeg) {
  const Workplace place;
  const std::vector<std::string> film = {"render",   "--scene", "gaussian_spot", "--animate", "nominal->nominal",
                                         "--frames", "3",       "--fps",         "12.5",      "-o",
                                         "a.mp4"};
  Options without;
  without.environment["PATH"] = place.folder().string();
  const Outcome missing = relign_bench(place, film, without);
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.err, HasSubstr("ffmpeg, which is not on PATH"));
  // A stand-in that records its arguments and copies the frames.
  const auto play = [&](const std::string& script) {
    place.write("ffmpeg", "#!/bin/sh\n" + script);
    std::filesystem::permissions(place.path("ffmpeg"), std::filesystem::perms::owner_all);
    Options with;
    with.environment["PATH"] = place.folder().string() + ":/usr/bin:/bin";
    return relign_bench(place, film, with);
  };
  const Outcome played = play(
      "echo \"$@\" > arguments\nwhile [ $# -gt 1 ]; do [ \"$1\" = -i ] && in=$2; shift; done\ncp \"$in\" \"$1\"\n");
  ASSERT_EQ(played.exit_code, 0) << played.err;
  const std::string arguments = place.read("arguments");
  EXPECT_THAT(arguments, HasSubstr("-framerate 12.5"));
  std::size_t side[2] = {0, 0};
  ASSERT_EQ(std::sscanf(arguments.c_str() + arguments.find("-video_size ") + 12, "%zux%zu", &side[0], &side[1]), 2);
  EXPECT_EQ(place.read("a.mp4").size(), 3 * side[0] * side[1]);
  const Outcome failed = play("echo no such codec >&2; exit 3\n");
  EXPECT_EQ(failed.exit_code, 2);
  EXPECT_THAT(failed.err, HasSubstr("no such codec"));
  for (const auto& entry : std::filesystem::directory_iterator(place.folder()))
    EXPECT_THAT(entry.path().string(), Not(HasSubstr(".part")));
}

TEST(CliAnimate, ReportsInvalidInput) {
  const Workplace place;
  const auto refusal = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"render", "--scene", "gaussian_spot"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = relign_bench(place, arguments);
    EXPECT_EQ(outcome.exit_code, 2);
    return outcome.err;
  };
  EXPECT_THAT(refusal({"-o", "a.gif"}), HasSubstr(".gif and .mp4 need --animate"));
  EXPECT_THAT(refusal({"--animate", "nominal->nominal", "-o", "a.png"}), HasSubstr("must end in .gif or .mp4"));
  EXPECT_THAT(refusal({"--animate", "nominal->0.5", "-o", "a.gif"}), HasSubstr("1 numbers given"));
  EXPECT_THAT(refusal({"--animate", "start->nominal", "-o", "a.gif"}), HasSubstr("only an instance has a start"));
  place.write("path.json", "{\"poses\": [\"nominal\",\n [2, 0, 0, 0, 0]]}");
  EXPECT_THAT(refusal({"--animate", "path.json", "-o", "a.gif"}), HasSubstr("path.json:2:2: /poses/1: pose: 2 for"));
  place.write("path.json", "{\"poses\": [\"nominal\"]}");
  EXPECT_THAT(refusal({"--animate", "path.json", "-o", "a.gif"}), HasSubstr("at least two poses"));
}

}  // namespace
}  // namespace relign::cli_test
