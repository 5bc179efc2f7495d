// Statistics on the page, and the page without them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "report/figures.h"
#include "report/made_pictures.h"
#include "report/made_statistics.h"
#include "report/page.h"
#include "report/page_json.h"
#include "report/residual_text.h"
#include "report/sections.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class Statistics : public MadePictures {
 protected:
  void write_two_levels(const std::string& name = "quick") {
    std::vector<records::TrialRecord> trials;
    for (const char* level : {"rho0", "rho0.5"})
      for (std::uint64_t i = 0; i < 3; ++i) {
        trials.push_back(trial(name, i, {0.1, 0.05, 0.02}, level));
        trials.push_back(trial("slow", i, {0.1, 0.09, 0.08}, level));
      }
    write(trials);
  }
  PageModel data() { return with_statistics(page_model(load_results(folder_))); }
  std::string html(const PageModel& page) { return page_html(page, load_gallery(folder_), {}); }
};

TEST_F(Statistics, ShowsSpecificationGatesAndIntervals) {
  write_two_levels();
  const std::string page = html(data());
  for (const char* words :
       {"specification: RMSE", "ok A/A", "ok replay 10/10", "moves to spec", "80 %</b>", "(64\u201388)", "not reached",
        "median (95 % interval)", "position / tilt", "2.4 \u00b5m / 0.60\u2032", "Pairwise comparisons", ">better<",
        "Training cost", "27 min", "740 lenses"})
    EXPECT_THAT(page, HasSubstr(words)) << words;
  EXPECT_THAT(page, Not(HasSubstr("do not rely on these results")));
}

TEST_F(Statistics, StatesTheNumberOfBuilds) {
  write_two_levels();
  EXPECT_THAT(html(data()), Not(HasSubstr("builds of relign-bench")));
  add_to_manifest({{"earlier_programs", Json::array({Json{{"hash", std::string(64, '0')}}})}});
  EXPECT_THAT(html(data()), HasSubstr("results from 2 builds of relign-bench"));
}

TEST_F(Statistics, FailedGatesPrecedeTheVerdict) {
  write_two_levels();
  PageModel broken = data();
  broken.gates.push_back({"replay", false, "trial 4f1c came out differently"});
  const std::string page = html(broken);
  EXPECT_THAT(page, HasSubstr("FAILED replay"));
  ASSERT_NE(page.find("trial 4f1c came out differently</li>"), std::string::npos);
  EXPECT_LT(page.find("trial 4f1c came out differently</li>"), page.find("<h2>Verdict"));
}

TEST_F(Statistics, OmitsSectionsWithoutData) {
  write_two_levels();
  PageModel bare = page_model(load_results(folder_));
  for (Group& group : bare.groups) {
    group.pairs.clear();
    group.ecdf.clear();
    group.own_optimum = group.next_image = kMissing;
    for (Row& row : group.rows) row.recommended.interval = {};
  }
  const std::string page = html(bare);
  for (const char* words : {"specification: RMSE", "moves to spec", "position / tilt", "Pairwise comparisons",
                            "Runtime distribution (ECDF)", "Training cost", "Yield and moves to specification"})
    EXPECT_THAT(page, Not(HasSubstr(words))) << words;
  EXPECT_THAT(page, HasSubstr("median (quartiles)"));
  EXPECT_THAT(page, HasSubstr("Methods by scene and noise level"));
}

TEST_F(Statistics, RankingHasAColumnOfAStatisticWithGroundTruthOnly) {
  write_two_levels();
  PageModel page = data();
  statistics::FinalStatistics shown = statistics::kFinalStatistics;
  shown[0].in_ranking = true;
  Row& row = page.groups[0].rows[0];
  row.finals[0] = {3, 0.02, {0.01, 0.04}};
  page.groups[0].rows[1].finals[0] = {};
  const auto columns = final_columns(page, shown);
  ASSERT_EQ(columns.size(), 1U);
  EXPECT_EQ(columns[0].title, "IQM");
  EXPECT_EQ(columns[0].unit, "of the final error (95 %)");
  EXPECT_EQ(std::stod(columns[0].cell(row).sort.value()), 0.02);
  EXPECT_EQ(columns[0].cell(page.groups[0].rows[1]).sort, no_cell().sort);
  for (Group& group : page.groups)
    for (Row& one : group.rows) one.finals[0].interval = {};
  EXPECT_EQ(final_columns(page, shown)[0].unit, "of the final error");
  for (Group& group : page.groups) group.measured_only = true;
  EXPECT_TRUE(final_columns(page, shown).empty()) << "a station has no final error";
}

TEST_F(Statistics, BoundOfOneMoreImageIsAboveTheOwnOptimum) {
  std::vector<records::TrialRecord> trials;
  for (std::uint64_t i = 0; i < 3; ++i) {
    trials.push_back(trial("quick", i, {0.1, 0.05}));
    trials.back().own_optimum.mse = 9e-6;
  }
  write(trials);
  add_to_manifest({{"scenes", {{{"name", "relign_od"}, {"folder", "scenes/abc"}}}}});
  const auto floor = [&] { return to_json(page_model(load_results(folder_)))["groups"][0]["floor"]; };
  EXPECT_FALSE(floor().contains("next_image"));
  const fs::path file = folder_ / "scenes/abc/next_image/rho0.json";
  write_file_atomically(file, R"({"format": 1, "lenses": [{"excess_mse": 1.5e-5}, {"excess_mse": 1.7e-5}]})");
  EXPECT_NEAR(floor()["own_optimum"].get<double>(), 0.003, 1e-12);
  EXPECT_NEAR(floor()["next_image"].get<double>(), 0.005, 1e-12);
  for (const char* damaged : {"", "[", R"({"lenses": []})", R"({"lenses": [{"excess_mse": -1}]})",
                              R"({"lenses": [{"excess_mse": "1e-5"}, 3]})"}) {
    write_file_atomically(file, damaged);
    EXPECT_FALSE(floor().contains("next_image")) << damaged;
  }
  write_file_atomically(folder_ / "elsewhere/next_image/rho0.json", R"({"lenses": [{"excess_mse": 1.5e-5}]})");
  add_to_manifest({{"scenes", {{{"name", "relign_od"}, {"folder", "elsewhere"}}}}});
  EXPECT_FALSE(floor().contains("next_image")) << "outside scenes/";
}

TEST_F(Statistics, WritesFigures) {
  write_two_levels();
  std::set<std::string> names;
  for (const fs::path& file : write_figures(data(), folder_ / "paper")) {
    EXPECT_TRUE(fs::exists(file)) << file;
    names.insert(file.filename().string());
  }
  EXPECT_THAT(names, testing::IsSupersetOf({"curves-1-rho0.svg", "curves-2-rho0.5.csv", "targets-1-rho0.svg",
                                            "misalignment-mm-1-rho0.svg", "misalignment-deg-1-rho0.csv",
                                            "yield-1-relign_od-paper.svg", "images-to-spec-1-relign_od-paper.csv"}));
  EXPECT_THAT(read_file(folder_ / "paper" / "curves-1-rho0.csv"),
              HasSubstr("series,images,error at the recommended pose (RMSE),low,high\nquick,0,0.1,0.08,0.13\n"));
  EXPECT_THAT(read_file(folder_ / "paper" / "yield-1-relign_od-paper.csv"), HasSubstr("quick,rho0.5,80,64,88\n"));
}

TEST_F(Statistics, EscapesNamesInPagesAndFileNames) {
  write_two_levels(kHostile);
  PageModel hostile = data();
  hostile.spec_text = kHostile;
  hostile.gates[0] = {kHostile, false, kHostile};
  for (Group& group : hostile.groups) {
    group.label = "../../" + kHostile;
    for (Row& row : group.rows) row.residual[0].name = row.residual[0].unit = kHostile;
    for (Pair& pair : group.pairs) pair.reason = kHostile;
  }
  TrainingCost& cost = hostile.training[0];
  cost.machine = cost.pays_after[0].label = cost.pays_after[0].against = kHostile;
  cost.pays_after[1].against = kHostile;
  cost.pays_after[1].lenses = std::numeric_limits<double>::infinity();
  const std::string page = html(hostile);
  EXPECT_THAT(page, Not(HasSubstr("<img")));
  EXPECT_THAT(page, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(page, Not(HasSubstr("\x1b")));
  for (const fs::path& file : write_figures(hostile, folder_ / "paper")) {
    EXPECT_EQ(file.parent_path(), folder_ / "paper");
    EXPECT_THAT(read_file(file), Not(HasSubstr("\x1b")));
    if (file.extension() == ".svg") {
      EXPECT_THAT(read_file(file), Not(HasSubstr("<img")));
    }
  }
}

TEST_F(Statistics, ShowsFilmsWithoutScripts) {
  write_two_levels();
  put("film.webp", made_film());
  put("end.png", made_png());
  write_index(Json::array({with_film(entry("quick", "median", "", "end.png"), "film.webp")}));
  const std::string page = html(data());
  EXPECT_THAT(page, HasSubstr("class=\"film-strips\" open"));
  EXPECT_THAT(page, HasSubstr("<span>0</span><span>1</span><span>9</span>"));
  EXPECT_THAT(page, HasSubstr("viewBox=\"0 0 6 2\""));
}

TEST(ResidualText, ShowsTheWorstPositionAndTiltInSuitableUnits) {
  const auto text = [](const char* unit, double a, double b) {
    return residual_of({{"p", unit, a, 1}, {"q", unit, b, kMissing}}).text;
  };
  EXPECT_EQ(text("mm", 0.0008, 0.0002), "0.80 \u00b5m");
  EXPECT_EQ(text("mm", 0.1, 0.25), "0.25 mm");
  EXPECT_EQ(text("deg", 0.01, 0.005), "0.60\u2032");
  EXPECT_EQ(residual_of({{"x", "mm", 0.0008, 1, 2}, {"Ry", "deg", 0.01, 1, 10}}).text, "0.80 \u00b5m / 0.60\u2032");
  EXPECT_EQ(residual_of({}).text, "-");
}

TEST(ResidualText, ShowsTheWorstAxisByShareOfItsTravel) {
  const std::vector<ResidualAxis> axes = {
      {"height", "um", 53, 60, 400}, {"coil", "A", 0.4, 0.6, 2}, {"gain", "", 0.1, 0.2, 10}, {"lost", "A", kMissing}};
  const Residual residual = residual_of(axes);
  EXPECT_EQ(residual.text, "coil 0.40 A (20 %)");
  EXPECT_EQ(residual.sort, "0.2");
  EXPECT_EQ(residual.details,
            "height 53.0 um (75 % below 60.0); coil 0.400 A (75 % below 0.600); gain 0.100 (75 % below 0.200)");
  EXPECT_EQ(residual_of({{"lost", "A", kMissing, kMissing, 2}}).text, "-");
}

// A hundred methods on fifty scenes, curves at 16 steps.
TEST_F(Statistics, LargePagesAreUnderTenMegabytes) {
  std::vector<double> errors;
  for (int step = 0; step < 17; ++step) errors.push_back(0.0123456789 + 0.0987654321 / (1 + step));
  write({trial("method", 0, errors)});
  PageModel small = page_model(load_results(folder_));
  const Group group = small.groups[0];
  const Method method = small.methods[0];
  small.methods.clear();
  small.groups.clear();
  small.verdict.clear();
  for (int m = 0; m < 100; ++m) {
    small.methods.push_back(method);
    small.methods.back().name = "method-" + std::to_string(m);
  }
  for (int scene = 0; scene < 50; ++scene) {
    Group one = group;
    one.scene = one.label = "scene " + std::to_string(scene);
    one.rows.assign(100, group.rows[0]);
    one.curves.assign(100, group.curves[0]);
    for (std::size_t m = 0; m < 100; ++m) one.rows[m].method = one.curves[m].method = small.methods[m].name;
    small.verdict.push_back({one.label, "method-0", "method-0 is best.", {}, ""});
    small.groups.push_back(one);
  }
  const std::size_t size = html(with_statistics(small)).size();
  EXPECT_LT(size + kMaxPictureBytes, 10'000'000u);
  EXPECT_GT(size, 3'000'000u) << "thinned more than necessary";
}

}  // namespace
}  // namespace relign::report
