#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "plugin_host/objects.h"

namespace relign {
namespace {

using plugin_host::Kind;
using testing::AllOf;
using testing::HasSubstr;

const char* const kRhoScene =
    R"({"name": "test", "axes": [{"name": "x"}, {"name": "y"}, {"name": "z"}, {"name": "Rx"}, {"name": "Ry"}],
                               "elements": ["L1", "L2", "L3", "L4"]})";

plugin_host::Catalog& catalog() {
  static auto* catalog = [] {
    auto* fresh = new plugin_host::Catalog;
    fresh->add(std::string(RELIGN_PLUGIN_DIR) + "/rho");
    return fresh;
  }();
  return *catalog;
}

plugin_host::NoiseLevel level(const std::string& id, const Json& parameters = {}) {
  return plugin_host::NoiseLevel(catalog().resolve_or_throw(Kind::noise_level, id, parameters), {});
}

Json draw(const std::string& id, std::uint64_t seed, const Json& parameters = {}, const char* scene = kRhoScene) {
  auto made = level(id, parameters);
  return Json::parse(made.draw(seed, scene));
}

// Mean and variance, compared within five standard errors of a normal distribution.
struct Moments {
  double n = 0;
  double sum = 0;
  double squares = 0;
  void add(double value) {
    ++n;
    sum += value;
    squares += value * value;
  }
  void expect_normal(double mean, double deviation) const {
    EXPECT_NEAR(sum / n, mean, 5 * deviation / std::sqrt(n));
    const double variance = squares / n - (sum / n) * (sum / n);
    EXPECT_NEAR(variance, deviation * deviation, 5 * deviation * deviation * std::sqrt(2 / n));
  }
};

TEST(Rho, MomentsMatchThePaper) {
  auto rho = level("rho0.5");
  std::vector<Moments> start(5), diagonal(5), offdiagonal(4), shift(3), tilt(2);
  Moments across;  // shift x of L3 times tilt x of L4: independent
  const int draws = 20000;
  for (int seed = 0; seed < draws; ++seed) {
    const Json w = Json::parse(rho.draw(static_cast<std::uint64_t>(seed), kRhoScene));
    ASSERT_EQ(w["elements"].size(), 2u);
    for (std::size_t axis = 0; axis < 5; ++axis) {
      const double value = w["start"][axis];
      ASSERT_TRUE(value >= 0 && value < 1);
      start[axis].add(value);
      diagonal[axis].add(w["distortion"][axis][axis]);
    }
    for (std::size_t i = 0; i < 4; ++i) offdiagonal[i].add(w["distortion"][i][i + 1]);
    for (const char* name : {"L3", "L4"}) {
      for (std::size_t i = 0; i < 3; ++i) shift[i].add(w["elements"][name]["shift_mm"][i]);
      for (std::size_t i = 0; i < 2; ++i) tilt[i].add(w["elements"][name]["tilt_deg"][i]);
    }
    across.add(w["elements"]["L3"]["shift_mm"][0].get<double>() * w["elements"]["L4"]["tilt_deg"][0].get<double>());
  }
  for (const Moments& moments : start) {
    EXPECT_NEAR(moments.sum / draws, 0.5, 5 * std::sqrt(1 / 12.0 / draws));
    EXPECT_NEAR(moments.squares / draws, 1 / 3.0, 5 * std::sqrt(4 / 45.0 / draws));
  }
  for (const Moments& moments : diagonal) moments.expect_normal(1, 0.01);
  for (const Moments& moments : offdiagonal) moments.expect_normal(0, 0.01);
  for (const Moments& moments : shift) moments.expect_normal(0, 2.5e-4);
  for (const Moments& moments : tilt) moments.expect_normal(0, 0.75);
  EXPECT_NEAR(across.sum / draws, 0, 5 * 2.5e-4 * 0.75 / std::sqrt(draws));
}

TEST(Rho, PackageFormHasRowsOfSumOneAndNoAxialShift) {
  auto rho = level("rho0.25-package");
  Moments shift, tilt, offdiagonal;
  const int draws = 20000;
  for (int seed = 0; seed < draws; ++seed) {
    const Json w = Json::parse(rho.draw(static_cast<std::uint64_t>(seed), kRhoScene));
    for (const Json& row : w["distortion"]) {
      double sum = 0;
      for (const double value : row) {
        ASSERT_GE(value, 0);
        sum += value;
      }
      ASSERT_NEAR(sum, 1, 1e-14);
    }
    offdiagonal.add(w["distortion"][0][1]);
    ASSERT_TRUE(w["elements"].contains("L2") && w["elements"].contains("L3") && w["elements"].size() == 2);
    for (const char* name : {"L2", "L3"}) {
      ASSERT_EQ(w["elements"][name]["shift_mm"][2], 0.0);
      for (std::size_t i = 0; i < 2; ++i) {
        shift.add(w["elements"][name]["shift_mm"][i]);
        tilt.add(w["elements"][name]["tilt_deg"][i]);
      }
    }
  }
  shift.expect_normal(0, 1.25e-5);
  tilt.expect_normal(0, 0.375);
  // |eps| / (1 + sum of five |eps|): mean by expansion to second order in the deviation s = 0.01,
  // s m - s^2 - 4 (s m)^2 with m = sqrt(2 / pi).
  const double m = std::sqrt(2 / std::acos(-1.0));
  EXPECT_NEAR(offdiagonal.sum / draws, 0.01 * m - 1e-4 - 4e-4 * m * m, 5 * 0.006 / std::sqrt(draws) + 2e-5);
}

TEST(Rho, LevelsDifferByScaleOnly) {
  const Json none = draw("rho0", 12);
  const Json half = draw("rho0.5", 12);
  const Json quarter = draw("rho0.25", 12);
  EXPECT_EQ(none["start"], half["start"]);
  EXPECT_EQ(none["distortion"], half["distortion"]);
  EXPECT_EQ(draw("rho0.5-package", 12)["start"], half["start"]);
  for (const char* name : {"L3", "L4"}) {
    EXPECT_EQ(none["elements"][name]["shift_mm"], (Json{0.0, 0.0, 0.0}));
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_DOUBLE_EQ(half["elements"][name]["shift_mm"][i].get<double>(),
                       2 * quarter["elements"][name]["shift_mm"][i].get<double>());
    for (std::size_t i = 0; i < 2; ++i)
      EXPECT_DOUBLE_EQ(half["elements"][name]["tilt_deg"][i].get<double>(),
                       2 * quarter["elements"][name]["tilt_deg"][i].get<double>());
  }
  // L3 has the same tilt deviates whether L2 or L4 is offset as well.
  EXPECT_EQ(draw("rho0.5-package", 12)["elements"]["L3"]["tilt_deg"], half["elements"]["L3"]["tilt_deg"]);
}

TEST(Rho, SeedDeterminesTheDraw) {
  EXPECT_NE(draw("rho0", 1)["start"], draw("rho0", 2)["start"]);
  EXPECT_NE(draw("rho0", 1)["distortion"], draw("rho0", 2)["distortion"]);
  EXPECT_EQ(draw("rho0.5", 1), draw("rho0.5", 1));
}

TEST(Rho, SelectsElementsByNameOrCount) {
  EXPECT_EQ(draw("rho", 3, {{"elements", "last:2"}}), draw("rho", 3, {{"elements", "L3, L4"}}));
  EXPECT_EQ(draw("rho", 3, {{"elements", "last:0"}})["elements"].size(), 0u);
  EXPECT_EQ(draw("rho", 3, {{"elements", "last:4"}})["elements"].size(), 4u);
}

std::string refusal(const Json& parameters, const char* scene = kRhoScene) {
  try {
    draw("rho", 1, parameters, scene);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::plugin_failed);
    return error.what();
  }
  return "accepted";
}

TEST(Rho, RejectsUnknownElements) {
  EXPECT_THAT(refusal({{"elements", "L2,L9"}}), AllOf(HasSubstr("no element 'L9'"), HasSubstr("L1, L2, L3, L4")));
  EXPECT_THAT(refusal({{"elements", "L9"}, {"level", 0}}), HasSubstr("no element 'L9'"));
  EXPECT_THAT(refusal({{"elements", "L2,"}}), HasSubstr("no element ''"));
  EXPECT_THAT(refusal({{"elements", "L2,L2"}}), HasSubstr("duplicate element 'L2'"));
  EXPECT_THAT(refusal({{"elements", "last:x"}}), HasSubstr("non-negative integer"));
  EXPECT_THAT(refusal({{"elements", "last:-1"}}), HasSubstr("non-negative integer"));
  EXPECT_THAT(refusal({{"elements", "last:5"}}), AllOf(HasSubstr("has only 4"), HasSubstr("use rho0")));
  EXPECT_THAT(refusal({}, "no JSON"), HasSubstr("parse error"));
  // Level 0 accepts a scene without elements.
  EXPECT_EQ(draw("rho0", 1, {}, R"({"axes": [1, 2], "elements": []})")["elements"], Json::object());
}

void expect_equal(const Json& drawn, const std::vector<double>& expected) {
  ASSERT_EQ(drawn.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_DOUBLE_EQ(drawn[i].get<double>(), expected[i]);
}

// Expected values from an independent Python implementation of Philox4x32-10 and the polar method.
TEST(Rho, MatchesIndependentImplementation) {
  const Json w = draw("rho0.5", 20250302);
  const std::vector<double> start = {0.6859271552788953, 0.01924810012575562, 0.6913955962761549, 0.77351944576811,
                                     0.4383793376487085};
  const std::vector<double> first_row = {0.9822395521834365, 0.004477717799190235, -0.002706266707406043,
                                         -0.01301587215714528, 0.006561612939978648};
  const std::vector<double> last_row = {0.0015956891991947284, 0.004871256317453238, -0.0013936423344940248,
                                        0.003768485216583358, 1.0109996888734156};
  const std::vector<double> shift_l3 = {0.0003859750516476543, -0.0002852392611782303, -0.0002372074853551753};
  const std::vector<double> tilt_l4 = {0.3046686831356584, -0.34518310770899574};
  expect_equal(w["start"], start);
  expect_equal(w["distortion"][0], first_row);
  expect_equal(w["distortion"][4], last_row);
  expect_equal(w["elements"]["L3"]["shift_mm"], shift_l3);
  expect_equal(w["elements"]["L4"]["tilt_deg"], tilt_l4);
}

}  // namespace
}  // namespace relign
