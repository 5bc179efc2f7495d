#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "base/error.h"
#include "error_text.h"
#include "optics/assembly.h"
#include "plugin_host/objects.h"
#include "plugin_host/test_folder.h"

namespace relign {
namespace {

using plugin_host::Kind;
using testing::AllOf;
using testing::HasSubstr;

// Three elements; the scene's pivot is 4 mm behind the first vertex; travels of 2 mm and 10 degrees.
const char* const kScene = R"({"name": "test", "nominal_pose": [0.5, 0.5, 0.5, 0.5, 0.5],
  "axes": [{"name": "x", "unit": "mm", "lower": -1, "upper": 1}, {"name": "y", "unit": "mm", "lower": -1, "upper": 1},
           {"name": "z", "unit": "mm", "lower": -1, "upper": 1}, {"name": "Rx", "unit": "deg", "lower": -5, "upper": 5},
           {"name": "Ry", "unit": "deg", "lower": -5, "upper": 5}],
  "elements": ["L1", "L2", "L3"],
  "geometry": {"pivot_z_mm": 4, "elements": {"L1": {"front_z_mm": 0, "back_z_mm": 2},
    "L2": {"front_z_mm": 3, "back_z_mm": 5}, "L3": {"front_z_mm": 9, "back_z_mm": 12}}}})";

class TolerancesTest : public test::FolderTest {
 protected:
  TolerancesTest() { catalog_.add(std::string(RELIGN_PLUGIN_DIR) + "/tolerances"); }

  plugin_host::NoiseLevel level(const std::string& id) {
    return plugin_host::NoiseLevel(catalog_.resolve_or_throw(Kind::noise_level, id), {});
  }
  plugin_host::NoiseLevel written(const std::string& text) {
    write("limits.json", text);
    return level((folder_ / "limits.json").string());
  }
  static Json draw(plugin_host::NoiseLevel level, std::uint64_t seed, const char* scene = kScene) {
    return Json::parse(level.draw(seed, scene));
  }
  std::string refusal(const std::string& text, const char* scene = kScene) {
    return test::error_text(ErrorKind::plugin_failed, [&] { draw(written(text), 1, scene); });
  }

  plugin_host::Catalog catalog_;
};

// Mean, mean square and largest magnitude of values within plus and minus a limit.
struct Sample {
  double n = 0, sum = 0, squares = 0, largest = 0;
  void add(double value) {
    ++n;
    sum += value;
    squares += value * value;
    largest = std::max(largest, std::fabs(value));
  }
  // Five standard errors; the square of a bounded value varies by less than limit^2 times its mean.
  void expect(double limit, double share) const {
    const double variance = share * limit * limit;
    EXPECT_LE(largest, limit * (1 + 1e-12));
    EXPECT_GT(largest, 0.95 * limit);
    EXPECT_NEAR(sum / n, 0, 5 * std::sqrt(variance / n));
    EXPECT_NEAR(squares / n, variance, 5 * limit * std::sqrt(variance / n));
  }
};

struct Law {
  const char* text;
  double share;  // variance as a share of limit^2
};

TEST_F(TolerancesTest, RefuseAxesOfOtherUnits) {
  EXPECT_THAT(refusal(R"({"use": "tolerances", "elements": {}, "start": {"shift_um": [1]}})",
                      R"({"name": "magnet", "nominal_pose": [0.5], "elements": [],
                          "axes": [{"name": "current", "unit": "A", "lower": -1, "upper": 1}]})"),
              HasSubstr("axis 'current' is in 'A', but limits are in micrometres and arcminutes"));
}

TEST_F(TolerancesTest, ValuesFollowTheirLawWithinTheirLimits) {
  // A standard normal distribution truncated at +- n has the variance 1 - 2 n phi(n) / (2 Phi(n) - 1).
  const Law laws[] = {{R"("limits_are_sigmas": 3)", 0.9733369 / 9},
                      {R"("limits_are_sigmas": 1)", 0.2911251},
                      {R"("law": "uniform")", 1.0 / 3}};
  for (const Law& law : laws) {
    SCOPED_TRACE(law.text);
    auto made = written(std::string(R"({"use": "tolerances", )") + law.text +
                        R"(, "elements": {"L2": {"shift_um": [10, 20, 5], "tilt_arcmin": [3, 6], "pivot": "scene"}},
                            "start": {"shift_um": [200, 200, 100], "tilt_arcmin": [30, 60]},
                            "movement": {"cross_talk": 0.02},
                            "cure_shift": {"shift_um": [4, 4, 2], "tilt_arcmin": [1, 0]}})");
    std::vector<Sample> shift(3), tilt(2), start(5), cure(4), eps(25);
    for (std::uint64_t seed = 0; seed < 20000; ++seed) {
      const Json w = Json::parse(made.draw(seed, kScene));
      ASSERT_EQ(w["elements"].size(), 1u);
      for (std::size_t i = 0; i < 3; ++i) shift[i].add(w["elements"]["L2"]["shift_mm"][i]);
      for (std::size_t i = 0; i < 2; ++i) tilt[i].add(w["elements"]["L2"]["tilt_deg"][i]);
      for (std::size_t i = 0; i < 5; ++i) start[i].add(w["start"][i].get<double>() - 0.5);
      for (std::size_t i = 0; i < 4; ++i) cure[i].add(w["cure_shift"][i]);
      ASSERT_EQ(w["cure_shift"][4], 0.0);
      for (std::size_t i = 0; i < 25; ++i)
        eps[i].add(w["distortion"][i / 5][i % 5].get<double>() - (i / 5 == i % 5 ? 1 : 0));
    }
    const double shift_mm[] = {0.010, 0.020, 0.005}, tilt_deg[] = {0.05, 0.1};
    const double start_share[] = {0.1, 0.1, 0.05, 0.05, 0.1};  // 200 um of 2 mm, ..., 60 arcmin of 10 degrees
    for (std::size_t i = 0; i < 3; ++i) shift[i].expect(shift_mm[i], law.share);
    for (std::size_t i = 0; i < 2; ++i) tilt[i].expect(tilt_deg[i], law.share);
    for (std::size_t i = 0; i < 5; ++i) start[i].expect(start_share[i], law.share);
    const double cure_share[] = {0.002, 0.002, 0.001, 1.0 / 600};
    for (std::size_t i = 0; i < 4; ++i) cure[i].expect(cure_share[i], law.share);
    for (const Sample& sample : eps) sample.expect(0.02, law.share);
  }
}

const std::string kStart = R"("start": {"shift_um": [0, 0, 0], "tilt_arcmin": [0, 0]})";

TEST_F(TolerancesTest, RotatesElementAboutItsPivot) {
  // With the scene's pivot the drawn shift and tilt are unchanged.
  const auto with_pivot = [&](const std::string& pivot) {
    return written(R"({"use": "tolerances", "elements": {"L3": {"shift_um": [40, 30, 20], "tilt_arcmin": [300, 200],
                       "pivot": ")" +
                   pivot + R"("}}, )" + kStart + "}");
  };
  optics::Prescription lens;
  lens.name = "test";
  lens.pivot_z_mm = 4;
  lens.elements = {{"L1", {}}, {"L2", {}}, {"L3", {}}};
  const std::pair<const char*, double> pivots[] = {{"own_front", 9}, {"own_centre", 10.5}, {"own_back", 12}};
  for (const auto& [pivot, z_mm] : pivots)
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      const Json own = draw(with_pivot("scene"), seed)["elements"]["L3"];
      const Json crossed = draw(with_pivot(pivot), seed)["elements"]["L3"];
      ASSERT_EQ(own["tilt_deg"], crossed["tilt_deg"]);
      ASSERT_GT(std::fabs(own["tilt_deg"][0].get<double>()), 1e-3);
      const optics::Assembly assembly(lens, {{"L3", {crossed["shift_mm"], crossed["tilt_deg"]}}});
      const optics::Vec3 moved = assembly.placement(2).point({0, 0, z_mm});
      EXPECT_NEAR(moved.x, own["shift_mm"][0].get<double>(), 1e-14);
      EXPECT_NEAR(moved.y, own["shift_mm"][1].get<double>(), 1e-14);
      EXPECT_NEAR(moved.z, z_mm + own["shift_mm"][2].get<double>(), 1e-14);
    }
}

TEST_F(TolerancesTest, StartIsNearNominalAndInsideTheTravel) {
  const std::string nominal_at_the_limit = std::string(kScene).replace(
      std::string(kScene).find("[0.5, 0.5, 0.5, 0.5, 0.5]"), 25, "[1.0, 0.5, 0.5, 0.5, 0.2]");
  auto made = written(R"({"use": "tolerances", "elements": {}, "law": "uniform",
                          "start": {"shift_um": [3000, 0, 0], "tilt_arcmin": [0, 30], "law": "normal"}})");
  int at_the_limit = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const Json start = Json::parse(made.draw(seed, nominal_at_the_limit))["start"];
    ASSERT_GE(start[0].get<double>(), 0);
    ASSERT_LE(start[0].get<double>(), 1);
    at_the_limit += start[0] == 1.0;
    EXPECT_EQ(start[1], 0.5);
    EXPECT_NEAR(start[4].get<double>(), 0.2, 0.05);
  }
  EXPECT_GT(at_the_limit, 50);
  EXPECT_LT(at_the_limit, 150);
}

TEST_F(TolerancesTest, DrawsDependOnSeedAndScaleWithLimits) {
  EXPECT_EQ(draw(level("tolerances-precision"), 7), draw(level("tolerances-precision"), 7));
  EXPECT_NE(draw(level("tolerances-precision"), 7), draw(level("tolerances-precision"), 8));
  const auto tilt = [&](const char* id, const char* element) {
    return draw(level(id), 7)["elements"][element]["tilt_deg"][1].get<double>();
  };
  for (const char* element : {"L1", "L2", "L3"})
    EXPECT_NEAR(tilt("tolerances-commercial", element), 20 * tilt("tolerances-high", element), 1e-12);
  EXPECT_NE(tilt("tolerances-high", "L1"), tilt("tolerances-high", "L2"));
  // An element has the same deviates whichever others have limits, and its own limits take precedence over "*".
  const std::string l2 = R"("L2": {"tilt_arcmin": [3, 3]})";
  const Json alone = draw(written(R"({"use": "tolerances", "elements": {)" + l2 + "}, " + kStart + "}"), 7)["elements"];
  const Json beside = draw(
      written(R"({"use": "tolerances", "elements": {)" + l2 + R"(, "*": {"tilt_arcmin": [9, 9]}}, )" + kStart + "}"),
      7)["elements"];
  EXPECT_EQ(alone.size(), 1u);
  EXPECT_EQ(beside.size(), 3u);
  EXPECT_EQ(alone["L2"], beside["L2"]);
}

TEST_F(TolerancesTest, ZeroLimitsGiveNominalDraw) {
  const Json w = draw(written(R"({"use": "tolerances", "elements": {}, )" + kStart +
                              R"(, "movement": {"backlash_um": 0, "repeatability_um": 0},
                                     "cure_shift": {"shift_um": [0, 0, 0], "tilt_arcmin": [0, 0]}})"),
                      3);
  EXPECT_FALSE(w.contains("cure_shift"));
  for (std::size_t i = 0; i < 25; ++i) EXPECT_EQ(w["distortion"][i / 5][i % 5], i / 5 == i % 5 ? 1.0 : 0.0);
  EXPECT_EQ(w["start"], Json(std::vector<double>(5, 0.5)));
  EXPECT_EQ(w["elements"], Json::object());
}

TEST_F(TolerancesTest, ReportsAllErrorsWithPositions) {
  const std::string text = refusal(R"({"use": "tolerances",
 "elements": {"L3": {"shift_um": [10, 10], "tilt_arcmin": [-3, 3], "pivot": "front", "shift_mm": 1}},
 "movement": {"cross_talk": 2, "backlash_um": -20, "drift_arcmin": 1, "resolution_arcmin": "fine", "pivot_um": [1, 2]},
 "limits_are_sigmas": 0, "colour": 1})");
  EXPECT_THAT(text, AllOf(HasSubstr("limits.json:2:34: /elements/L3/shift_um"), HasSubstr("found -3"),
                          HasSubstr("found 'front'; allowed: own_front"), HasSubstr("/elements/L3/shift_mm"),
                          HasSubstr("/movement/cross_talk"), HasSubstr("missing key 'start'"), HasSubstr("colour")));
  EXPECT_THAT(text, AllOf(HasSubstr("limits.json:3:47: /movement/backlash_um"), HasSubstr("/movement/pivot_um"),
                          HasSubstr("missing key 'drift_seconds'"), HasSubstr("/movement/resolution_arcmin")));
  EXPECT_THAT(refusal("{\"use\": \"tolerances\"}"), HasSubstr("missing key 'elements'"));
  EXPECT_THAT(refusal(R"({"use": "tolerances", "elements": 3, "start": {"shift_um": 4}})"),
              AllOf(HasSubstr("/elements: expected an object"), HasSubstr("/start/shift_um: expected a list")));
}

std::string moving(const std::string& movement) {
  return R"({"use": "tolerances", "elements": {}, )" + kStart + R"(, "movement": )" + movement + "}";
}

TEST_F(TolerancesTest, GivesErrorsOfTheStageInSharesOfTheTravel) {
  // Travels are 2 mm and 10 degrees, so that 20 um and 6 arcmin are 0.01.
  const Json stage = draw(written(moving(R"({"backlash_um": 20, "backlash_arcmin": 6, "repeatability_um": [1, 2, 3],
                                             "resolution_arcmin": [0.6, 1.2]})")),
                          1)["stage"];
  EXPECT_EQ(stage.size(), 3u);
  const auto expect = [&](const char* key, const std::vector<double>& shares) {
    for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(stage[key][i].get<double>(), shares[i], 1e-15) << key << i;
  };
  expect("backlash", {0.01, 0.01, 0.01, 0.01, 0.01});
  expect("repeatability", {0.0005, 0.001, 0.0015, 0, 0});
  expect("encoder_step", {0, 0, 0, 0.001, 0.002});
  EXPECT_FALSE(draw(written(moving(R"({"cross_talk": 0.01})")), 1).contains("stage"));
  // Nothing else of a draw changes.
  Json with = draw(level("tolerances-stepper-stage"), 4), without = draw(level("tolerances-precision"), 4);
  EXPECT_EQ(with["start"], without["start"]);
  EXPECT_EQ(with["elements"], without["elements"]);
}

TEST_F(TolerancesTest, DrawsDriftForEveryInstance) {
  auto made = written(moving(R"({"drift_um": [20, 0, 40], "drift_arcmin": 6, "drift_seconds": 900})"));
  std::vector<Sample> drift(5);
  for (std::uint64_t seed = 0; seed < 20000; ++seed) {
    const Json stage = Json::parse(made.draw(seed, kScene))["stage"];
    ASSERT_EQ(stage["drift_seconds"], 900);
    for (std::size_t i = 0; i < 5; ++i) drift[i].add(stage["drift"][i]);
  }
  const double limits[] = {0.01, 0, 0.02, 0.01, 0.01};
  for (std::size_t i = 0; i < 5; ++i)
    if (limits[i] > 0)
      drift[i].expect(limits[i], 0.9733369 / 9);
    else
      EXPECT_EQ(drift[i].largest, 0);
}

// Displacement in mm of the scene's pivot where the stage rotates about a point at q from it: q - Rx Ry q.
std::array<double, 3> displaced(const std::array<double, 3>& q, double rx_deg, double ry_deg) {
  const optics::Prescription lens = [] {
    optics::Prescription at_origin;
    at_origin.name = "test";
    at_origin.elements = {{"L1", {}}};
    return at_origin;
  }();
  const optics::Assembly rotated(lens, {{"L1", {{0, 0, 0}, {rx_deg, ry_deg}}}});
  const optics::Vec3 moved = rotated.placement(0).point({q[0], q[1], q[2]});
  return {q[0] - moved.x, q[1] - moved.y, q[2] - moved.z};
}

TEST_F(TolerancesTest, RotatesTheStageAboutItsRealPivot) {
  auto made = written(moving(R"({"pivot_um": [300, 200, 500]})"));
  const double per_degree = 180 / 3.14159265358979323846;
  Sample samples[3];
  for (std::uint64_t seed = 0; seed < 20000; ++seed) {
    const Json d = Json::parse(made.draw(seed, kScene))["distortion"];
    const auto mm_per_radian = [&](std::size_t row, std::size_t column) {  // travels of 2 mm and 10 degrees
      return d[row][column].get<double>() * 2 / 10 * per_degree;
    };
    const std::array<double, 3> q = {mm_per_radian(2, 4), -mm_per_radian(2, 3), mm_per_radian(1, 3)};
    for (std::size_t i = 0; i < 3; ++i) samples[i].add(q[i]);
    if (seed >= 20) continue;
    const double rx = 0.03, ry = -0.05;  // degrees
    const std::array<double, 3> exact = displaced(q, rx, ry);
    for (std::size_t row = 0; row < 3; ++row)
      EXPECT_NEAR((mm_per_radian(row, 3) * rx + mm_per_radian(row, 4) * ry) / per_degree, exact[row], 1e-6);
    for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(d[i][i], 1.0);
  }
  const double limits[] = {0.3, 0.2, 0.5};
  for (std::size_t i = 0; i < 3; ++i) samples[i].expect(limits[i], 0.9733369 / 9);
}

TEST_F(TolerancesTest, DrawsTheMeanOfABatchFromEverySeed) {
  const std::string base = R"({"use": "tolerances", "elements": {}, )" + kStart +
                           R"(, "cure_shift": {"shift_um": [1, 1, 1], "tilt_arcmin": [0, 0]})";
  auto made = written(base + R"(, "batch": {"size": 25, "inspection_um": [0.5, 0.5, 1], "inspection_arcmin": 0.6,
      "cure_shift": {"shift_um": [20, 10, 0], "tilt_arcmin": [6, 6], "law": "uniform"}}})");
  std::vector<Sample> mean(5);
  for (std::uint64_t seed = 0; seed < 20000; ++seed) {
    const Json batch = Json::parse(made.draw(seed, kScene))["batch"];
    ASSERT_EQ(batch["size"], 25);
    for (std::size_t i = 0; i < 5; ++i) mean[i].add(batch["cure_shift"][i]);
  }
  const double limits[] = {0.01, 0.005, 0, 0.01, 0.01}, inspection[] = {0.00025, 0.00025, 0.0005, 0.001, 0.001};
  Json drawn = Json::parse(made.draw(7, kScene));
  for (std::size_t i = 0; i < 5; ++i) {
    if (limits[i] > 0) mean[i].expect(limits[i], 1.0 / 3);
    EXPECT_NEAR(drawn["batch"]["inspection"][i].get<double>(), inspection[i], 1e-15);
  }
  EXPECT_EQ(mean[2].largest, 0);
  // A module's own shift does not depend on the batch.
  drawn.erase("batch");
  EXPECT_EQ(drawn, draw(written(base + "}"), 7));
}

TEST_F(TolerancesTest, RejectsMalformedBatches) {
  const auto batch = [&](const std::string& text) {
    return refusal(R"({"use": "tolerances", "elements": {}, )" + kStart + R"(, "batch": )" + text + "}");
  };
  EXPECT_THAT(batch("{}"), AllOf(HasSubstr("missing key 'size'"), HasSubstr("missing key 'cure_shift'")));
  EXPECT_THAT(batch(R"({"size": 0, "cure_shift": {"shift_um": [-1]}, "inspection_um": -1, "modules": 2})"),
              AllOf(HasSubstr("/batch/size"), HasSubstr("/batch/cure_shift/shift_um/0: expected a number from 0"),
                    HasSubstr("/batch/inspection_um"), HasSubstr("/batch/modules: unknown key")));
  EXPECT_THAT(batch(R"({"size": 25, "cure_shift": {"shift_um": [1, 1], "tilt_arcmin": [1, 1]}})"),
              AllOf(HasSubstr("/batch/cure_shift"), HasSubstr("none for axis 'z'")));
  EXPECT_THAT(batch(R"({"size": 25, "cure_shift": {"shift_um": [1, 1, 1], "tilt_arcmin": [1, 1]},
                       "inspection_um": [1]})"),
              AllOf(HasSubstr("/batch/inspection_um"), HasSubstr("none for axis 'y'")));
}

TEST_F(TolerancesTest, RejectsStagesThatDoNotFitTheScene) {
  EXPECT_THAT(refusal(moving(R"({"repeatability_um": [1, 1]})")),
              AllOf(HasSubstr("/movement/repeatability_um"), HasSubstr("has 2 numbers, none for axis 'z'")));
  EXPECT_THAT(refusal(moving(R"({"backlash_um": 3000})")),
              HasSubstr("axis 'x' of the scene exceeds its travel: found 3000, allowed: up to "));
  EXPECT_THAT(refusal(moving(R"({"backlash_um": [3, 3, 3, 3, 3]})")),
              AllOf(HasSubstr("/movement/backlash_um"), HasSubstr("has 5 numbers, but the scene has 3 axes in mm")));
  EXPECT_THAT(refusal(moving(R"({"backlash_arcmin": [3, 3, 3]})")), HasSubstr("the scene has 2 axes in degrees"));
  EXPECT_THAT(
      refusal(R"({"use": "tolerances", "elements": {}, "start": {"shift_um": 100, "tilt_arcmin": 60}})"),
      AllOf(HasSubstr(
                "/start/shift_um: expected a list of at most 64 numbers (along the scene's axes in mm, micrometres)"),
            HasSubstr("found 60")));
  const char* const others = R"({"axes": [{"name": "x", "unit": "mm", "lower": 0, "upper": 1},
                                           {"name": "phi", "unit": "deg", "lower": 0, "upper": 1}]})";
  const std::string start = R"("start": {"shift_um": [1], "tilt_arcmin": [1]}, )";
  const std::string pivot =
      R"({"use": "tolerances", "elements": {}, )" + start + R"("movement": {"pivot_um": [1, 1, 1]}})";
  EXPECT_THAT(refusal(pivot, others), AllOf(HasSubstr("/movement/pivot_um"), HasSubstr("'phi'")));
  const char* const without_y = R"({"axes": [{"name": "x", "unit": "mm", "lower": 0, "upper": 1},
                                              {"name": "Rx", "unit": "deg", "lower": 0, "upper": 1}]})";
  EXPECT_THAT(refusal(pivot, without_y), HasSubstr("moves the lens along 'y', which is not an axis"));
}

TEST_F(TolerancesTest, RejectsScenesThatDoNotFitTheFile) {
  EXPECT_THAT(refusal(R"({"use": "tolerances", "elements": {"L9": {}}, )" + kStart + "}"),
              AllOf(HasSubstr("limits.json:1:42: /elements/L9"), HasSubstr("has: L1, L2, L3")));
  EXPECT_THAT(refusal(R"({"use": "tolerances", "elements": {}, "start": {"shift_um": [1, 1, 1], "tilt_arcmin": [1]}})"),
              AllOf(HasSubstr("/start"), HasSubstr("'tilt_arcmin' has 1"), HasSubstr("axis 'Ry'")));
  const char* const no_geometry =
      R"({"axes": [{"name": "x", "unit": "mm", "lower": 0, "upper": 1}], "elements": ["A"]})";
  const std::string tilted =
      R"({"use": "tolerances", "elements": {"*": {"tilt_arcmin": [3, 3]}}, "start": {"shift_um": [1]}})";
  EXPECT_THAT(refusal(tilted, no_geometry), AllOf(HasSubstr("/elements/*"), HasSubstr("\"pivot\": \"scene\"")));
  const std::string about_scene =
      R"({"use": "tolerances", "elements": {"*": {"tilt_arcmin": [3, 3], "pivot": "scene"}}, "start": {"shift_um": [1]}})";
  EXPECT_EQ(draw(written(about_scene), 1, no_geometry)["elements"].size(), 1u);
  // A grade for all elements accepts a scene without elements.
  EXPECT_EQ(draw(level("tolerances-high"), 1,
                 R"({"axes": [{"name": "x", "unit": "mm", "lower": 0, "upper": 1}]})")["elements"],
            Json::object());
}

}  // namespace
}  // namespace relign
