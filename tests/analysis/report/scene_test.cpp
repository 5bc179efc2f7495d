// The scenes on the page: lens drawing and landscape, also from damaged and hostile folders.
#include <gmock/gmock.h>

#include "markup/escape.h"
#include "report/figures.h"
#include "report/made_results.h"
#include "report/page_json.h"
#include "report/report.h"
#include "report/scene_data.h"

namespace relign::report {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr const char* kDrawing =
    "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 2 1\"><script>bad()</script></svg>";

class ScenePart : public MadeResults {
 protected:
  void SetUp() override {
    MadeResults::SetUp();
    write({trial("a", 0, {0.1, 0.05}), trial("b", 0, {0.1, 0.09})});
    add_to_manifest({{"scenes", {{{"name", "relign_od"}, {"id", "relign_od"}, {"folder", "scenes/1f"}}}}});
    put("description.json", {{"summary", "A wide lens"},
                             {"image", {{"width", 200}, {"height", 100}}},
                             {"axes",
                              {{{"name", "x"}, {"unit", "mm"}, {"lower", -1}, {"upper", 1}},
                               {{"name", "Ry"}, {"unit", "deg"}, {"lower", -7}, {"upper", 7}}}}});
    put("landscape.json", landscape());
    write_file_atomically(folder_ / "scenes/1f/lens.svg", kDrawing);
  }
  void put(const std::string& name, const Json& value) {
    write_file_atomically(folder_ / "scenes/1f" / name, value.dump());
  }
  static Json landscape() {
    return {{"format", 1},
            {"lens", "perfect"},
            {"pose", {0.5, 0.5}},
            {"lines",
             {{{"axis", "x"}, {"shares", {0, 0.5, 1}}, {"mse", {0.0016, -1e-9, 0.0009}}},
              {{"axis", "Ry"}, {"shares", {0, 0.5, 1}}, {"mse", {0.0025, -1e-9, nullptr}}}}},
            {"plane",
             {{"across", "x"},
              {"up", "Ry"},
              {"across_shares", {0.4, 0.5, 0.6}},
              {"up_shares", {0.45, 0.55}},
              {"mse", {1e-4, 0, 1e-4, 4e-4, 0, 4e-4}}}}};
  }
  Json facts() { return to_json(page_model(load_results(folder_)))["scene_facts"][0]; }
};

TEST_F(ScenePart, HasEveryAxisThatASceneMayHave) {
  Json axes = Json::array();
  for (int i = 0; i < 64; ++i)
    axes.push_back({{"name", "a" + std::to_string(i)}, {"unit", "nm"}, {"lower", -1}, {"upper", 1}});
  put("description.json", {{"axes", axes}});
  const Json shown = facts()["axes"];
  ASSERT_EQ(shown.size(), 64U);
  EXPECT_THAT(shown[63].dump(), HasSubstr("a63"));
}

TEST_F(ScenePart, ShowsLensTravelAndTheErrorAroundTheNominalPose) {
  const Json shown = facts()["landscape"];
  EXPECT_EQ(shown["lines"][0]["away"], Json({-50, 0, 50}));
  EXPECT_EQ(shown["lines"][0]["rmse"], Json({0.04, 0, 0.03})) << "signed in the file, clipped on the page";
  EXPECT_TRUE(shown["lines"][1]["rmse"][2].is_null());
  EXPECT_EQ(shown["plane"]["across"]["values"], Json({-0.2, 0, 0.2}));
  EXPECT_EQ(shown["plane"]["rmse"], Json({0.01, 0, 0.01, 0.02, 0, 0.02}));

  const std::string page = Report(folder_).html();
  for (const char* words :
       {"<h2>Scene<", "A wide lens", "x -1 to 1 mm, Ry -7 to 7 deg", "200 x 100 pixels",
        "displaced from the nominal one along one axis at a time", "over x and Ry", "\"map\":{\"across\""})
    EXPECT_THAT(page, HasSubstr(words)) << words;
  EXPECT_THAT(page, HasSubstr("<img src=\"data:image/svg+xml;base64," + base64(kDrawing) + "\""));
  EXPECT_THAT(page, Not(HasSubstr("bad()"))) << "images run no scripts, and their text is not markup";
}

TEST_F(ScenePart, ShowsTheModelOfMachineTime) {
  EXPECT_THAT(Report(folder_).html(), Not(HasSubstr("Simulated machine time: ")));
  const Json own = {
      {"speed_mm_per_s", 5}, {"speed_deg_per_s", 4}, {"settle_ms", 40}, {"exposure_ms", 15}, {"readout_ms", 30}};
  const auto scene = [&](bool station) {
    return Json::array({{{"name", "relign_od"},
                         {"id", "relign_od"},
                         {"folder", "scenes/1f"},
                         {"owns_stage", station},
                         {"machine_time", own}}});
  };
  add_to_manifest({{"scenes", scene(false)}, {"machine_time", {{"settle_ms", 7.5}}}});
  EXPECT_THAT(Report(folder_).html(),
              HasSubstr("Simulated machine time: 5 mm/s, 4 degrees/s, 7.5 ms to settle, 15 ms exposure, 30 ms "
                        "readout."));
  add_to_manifest({{"scenes", scene(true)}});
  EXPECT_FALSE(facts().contains("machine_time")) << "stations have their own clock";
}

TEST_F(ScenePart, ShowsTheSpeedsOfTheAxes) {
  const auto axis = [](const char* name, const char* unit, double speed) {
    Json made = {{"name", name}, {"unit", unit}, {"lower", -1}, {"upper", 1}};
    if (speed > 0) made["speed_per_s"] = speed;
    return made;
  };
  add_to_manifest({{"scenes",
                    {{{"name", "relign_od"},
                      {"id", "relign_od"},
                      {"folder", "scenes/1f"},
                      {"machine_time", {{"speed_mm_per_s", 5}, {"speed_deg_per_s", 4}, {"settle_ms", 40}}}}}}});
  put("description.json",
      {{"axes", {axis("a", "mrad", 0.2), axis("h", "um", 200), axis("b", "mrad", 0.2), axis("g", "", 3)}}});
  EXPECT_THAT(Report(folder_).html(),
              HasSubstr("Simulated machine time: 0.2 mrad/s (a, b), 200 um/s (h), 3/s (g), 40 ms to settle."));
  EXPECT_EQ(facts()["machine_time"], Json({{"settle_ms", 40}}));
  EXPECT_EQ(facts()["axes"][1]["speed_per_s"], 200);
  put("description.json", {{"axes", {axis("a", "mrad", 0.2), axis("x", "mm", 0)}}});
  EXPECT_THAT(Report(folder_).html(), HasSubstr("Simulated machine time: 0.2 mrad/s (a), 5 mm/s, 40 ms to settle."));
}

TEST_F(ScenePart, WritesTheLandscapeAsAFigure) {
  Report(folder_).write_figures(folder_ / "paper");
  EXPECT_THAT(
      read_file(folder_ / "paper/landscape-1-relign_od.csv"),
      HasSubstr("series,% of the travel from the nominal pose,noise-free error (RMSE),low,high\nx,-50,0.04,,\n"));
  EXPECT_THAT(read_file(folder_ / "paper/landscape-1-relign_od.svg"), HasSubstr("</svg>"));
}

TEST_F(ScenePart, OmitsDamagedParts) {
  const auto without = [this](const Json& changed) {
    put("landscape.json", changed);
    EXPECT_NO_THROW(Report(folder_).html());
    return facts();
  };
  Json newer = landscape();
  newer["format"] = 2;
  EXPECT_FALSE(without(newer).contains("landscape"));
  EXPECT_FALSE(without("text").contains("landscape"));
  for (const auto& [pointer, value] :
       std::vector<std::pair<const char*, Json>>{{"/plane/mse", {1, 2}},
                                                 {"/plane/across_shares", {0.6, 0.5, 0.4}},
                                                 {"/plane/up_shares", {0, 7}},
                                                 {"/plane/across", "nothing"},
                                                 {"/plane/mse/0", "x"},
                                                 {"/plane/up_shares/0", nullptr}}) {
    Json changed = landscape();
    changed[Json::json_pointer(pointer)] = value;
    const Json left = without(changed);
    EXPECT_FALSE(left["landscape"].contains("plane")) << pointer;
    EXPECT_EQ(left["landscape"]["lines"].size(), 2U) << pointer;
  }
  Json one = landscape();
  one["lines"][0]["mse"] = {1};
  EXPECT_EQ(without(one)["landscape"]["lines"].size(), 1U);
  for (const char* key : {"pose", "lines"}) {
    Json changed = landscape();
    changed[key] = {nullptr, "x", {{"shares", 3}}};
    EXPECT_FALSE(without(changed).contains("landscape")) << key;
  }
  std::filesystem::remove_all(folder_ / "scenes");
  EXPECT_THAT(Report(folder_).html(), Not(HasSubstr("<h2>Scene<")));
}

TEST_F(ScenePart, ReadsNothingOutsideScenes) {
  write_file_atomically(folder_ / "lens.svg", "<svg>secret</svg>");
  const auto drawings = [this](const std::string& folder) {
    const Json manifest = {{"scenes", {{{"name", "relign_od"}, {"folder", folder}}}}};
    return scene_drawings(folder_, records::made_manifest(manifest)).size();
  };
  EXPECT_EQ(drawings("scenes/1f"), 1U);
  for (const char* folder : {"", ".", "scenes/..", "scenes/1f/../..", "/etc"})
    EXPECT_EQ(drawings(folder), 0U) << folder;
  std::filesystem::create_directory_symlink(folder_, folder_ / "scenes/link");
  EXPECT_EQ(drawings("scenes/link"), 0U);
  write_file_atomically(folder_ / "scenes/1f/lens.svg", "<html>no drawing</html>");
  EXPECT_EQ(drawings("scenes/1f"), 0U);
  write_file_atomically(folder_ / "scenes/1f/lens.svg", "<svg>" + std::string(400'000, ' ') + "</svg>");
  EXPECT_EQ(drawings("scenes/1f"), 0U) << "too large for a page";
}

TEST_F(ScenePart, EscapesNames) {
  add_to_manifest({{"scenes", {{{"name", kHostile}, {"id", kHostile}, {"folder", "scenes/1f"}}}}});
  put("description.json", {{"summary", kHostile},
                           {"axes",
                            {{{"name", kHostile}, {"unit", kHostile}, {"lower", 0}, {"upper", 1}},
                             {{"name", "Ry"}, {"unit", kHostile}, {"lower", 0}, {"upper", 1}}}}});
  Json hostile = landscape();
  hostile["lines"][0]["axis"] = hostile["plane"]["across"] = kHostile;
  put("landscape.json", hostile);
  const std::string page = Report(folder_).html();
  const std::string part = page.substr(page.find("<section id=\"scene\">"));
  const std::string scene = part.substr(0, part.find("</section>"));
  EXPECT_THAT(scene, HasSubstr("&lt;img src=x"));
  EXPECT_THAT(scene, Not(HasSubstr("<img src=x")));
  EXPECT_THAT(scene, Not(HasSubstr("<script")));
  EXPECT_THAT(page, HasSubstr("\"map\":{\"across\""));
  for (const std::filesystem::path& file : Report(folder_).write_figures(folder_ / "paper"))
    EXPECT_EQ(file.parent_path(), folder_ / "paper");
}

}  // namespace
}  // namespace relign::report
