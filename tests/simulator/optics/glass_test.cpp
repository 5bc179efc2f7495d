// Glasses against published indices and Abbe numbers.
#include "optics/glass.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "optics/prescription.h"

namespace relign::optics {
namespace {

using testing::HasSubstr;

constexpr double kD = 587.5618, kF = 486.1327, kC = 656.2725;

double abbe(const Glass& glass) {
  return (refractive_index(glass, kD) - 1) / (refractive_index(glass, kF) - refractive_index(glass, kC));
}

// Of a lens file with this glass as its own.
std::string complaint(const std::string& glass) {
  const std::string lens = R"({"glasses": {"G": )" + glass + R"(}, "name": "plate", "image_z_mm": 9,
    "elements": [{"name": "P", "faces": [{"z_mm": 0, "radius_mm": null, "clear_radius_mm": 1, "index_after": 1.5},
                                         {"z_mm": 1, "radius_mm": null, "clear_radius_mm": 1}]}],
    "stops": [{"name": "S", "z_mm": -1, "opening_radius_mm": 1, "aperture": true}]})";
  try {
    read_prescription(JsonSource::from_text(lens, "g.json"));
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Glass, MatchesIndexAtTheSodiumLines) {
  const std::map<std::string, double> known = {
      {"N-BK7", 1.51672767}, {"N-SK16", 1.62031788}, {"N-LAK34", 1.72904046}, {"N-LASF44", 1.80404585}};
  for (const auto& [name, index] : known) EXPECT_NEAR(refractive_index(*find_glass(name), 589.3), index, 5e-9) << name;
}

// nd and Vd as the catalogue prints them, for every built-in glass.
TEST(Glass, MatchesPrintedIndexAndDispersion) {
  const std::map<std::string, std::pair<double, double>> printed = {
      {"F2", {1.62004, 36.37}},      {"K10", {1.50137, 56.41}},     {"LF5", {1.58144, 40.85}},
      {"N-BAF10", {1.67003, 47.11}}, {"N-BK7", {1.51680, 64.17}},   {"N-F2", {1.62005, 36.43}},
      {"N-LAK12", {1.67790, 55.20}}, {"N-LAK34", {1.72916, 54.50}}, {"N-LASF44", {1.80420, 46.50}},
      {"N-SF11", {1.78472, 25.68}},  {"N-SK15", {1.62296, 58.02}},  {"N-SK16", {1.62041, 60.32}},
      {"SF4", {1.75520, 27.58}},     {"SK16", {1.62041, 60.28}}};
  for (const auto& [name, numbers] : printed) {
    const Glass& glass = *find_glass(name);
    EXPECT_NEAR(refractive_index(glass, kD), numbers.first, 0.6e-5) << name;
    EXPECT_NEAR(abbe(glass), numbers.second, 0.6e-2) << name;
  }
  EXPECT_EQ(find_glass("N-BK8"), nullptr);
}

// nd and Vd as the vendors print them.
TEST(Glass, MatchesVendorCatalogues) {
  const std::map<std::string, std::pair<double, double>> printed = {
      {"BK7", {1.51680, 64.17}},    {"SF6", {1.80518, 25.43}},   {"S-FPL53", {1.43875, 94.93}},
      {"FCD1", {1.49700, 81.61}},   {"H-K9L", {1.51680, 64.20}}, {"H-LaK51A", {1.69680, 55.53}},
      {"J-BK7A", {1.51680, 64.13}}, {"PMMA", {1.49176, 57.44}},  {"SILICA", {1.45846, 67.82}}};
  for (const auto& [name, numbers] : printed) {
    ASSERT_NE(find_glass(name), nullptr) << name;
    EXPECT_NEAR(refractive_index(*find_glass(name), kD), numbers.first, 1.5e-4) << name;
    EXPECT_NEAR(abbe(*find_glass(name)), numbers.second, 0.08) << name;
  }
  std::set<std::string> names;
  for (const std::string& name : glass_names()) {
    EXPECT_TRUE(names.insert(name).second) << name << " is a duplicate";
    EXPECT_NO_THROW(refractive_index(*find_glass(name), kD)) << name;
  }
  EXPECT_GT(names.size(), 900U);
}

TEST(Glass, FindsNameVariants) {
  const auto found = [](const std::string& name) {
    const Glass* glass = find_glass_like(name);
    return glass ? glass->name : "none";
  };
  EXPECT_EQ(found("N-BK7"), "N-BK7");
  EXPECT_EQ(found("NBK7_SCHOTT"), "N-BK7");
  EXPECT_EQ(found("n-bk7-schott"), "N-BK7");
  EXPECT_EQ(found("bk7"), "BK7");
  EXPECT_EQ(found("BK7_SCHOTT"), "BK7");
  EXPECT_EQ(found("E48R_ZEON"), "E48R");
  EXPECT_EQ(found("silica_special"), "SILICA");
  EXPECT_EQ(found("SFPL53_OHARA"), "S-FPL53");
  EXPECT_EQ(found("HLAK53A_CDGM"), "H-LaK53A");
  EXPECT_EQ(found("SK16_SCHOTT"), "SK16");
  // The vendor selects between two glasses of the same name; other vendors give none.
  EXPECT_EQ(found("F2"), "F2");
  EXPECT_EQ(found("F2_CDGM"), "F2_CDGM");
  EXPECT_EQ(found("N-BK7_OHARA"), "none");
  EXPECT_EQ(found("N-BK8"), "none");
  EXPECT_EQ(found("_SCHOTT"), "none");
  EXPECT_EQ(found(""), "none");
}

// One dispersion expressed in every formula that can represent it: N-BK7's, or a Cauchy law.
TEST(Glass, EquivalentFormulasAgree) {
  const Glass bk7 = *find_glass("N-BK7");
  const std::vector<double>& c = bk7.coefficients;
  const Glass six{"6", 6, {c[0], c[1], c[2], c[3], c[4], c[5]}};
  const Glass eleven{"11", 11, {c[0], c[1], 0, 0, c[2], c[3], c[4], c[5]}};
  const Glass two_terms{"2", 2, {c[0], c[1], c[2], c[3]}};
  const Glass four{"4", 4, {0, c[0], c[1], c[2], c[3]}};
  const Glass nine{"9", 9, {1, c[0], c[1], c[2], c[3]}};
  const Glass one_term{"2", 2, {c[0], c[1]}};
  const Glass eight{"8", 8, {1, c[0], c[1]}};
  // k w2 / (w2 - l) = k + k l / (w2 - l)
  const Glass seven{"7", 7, {1 + c[0], c[0] * c[1], c[1]}};
  const Glass schott{"1", 1, {2.3, -0.01, 0.011, 2e-4, -1e-6, 1e-7}};
  const Glass ten{"10", 10, schott.coefficients};
  const Glass twelve{"12", 12, schott.coefficients};
  const Glass thirteen{"13", 13, {2.3, -0.01, 0, 0.011, 2e-4, -1e-6, 1e-7}};
  const Glass twelve_high{"12", 12, {2.3, -0.01, 0.011, 0, 0, 0, 1e-4}};
  const Glass thirteen_high{"13", 13, {2.3, -0.01, 1e-4, 0.011}};
  const Glass ten_low{"10", 10, {2.3, 0, 0, 0, 0, 0, 1e-6, 1e-7}};
  const Glass thirteen_low{"13", 13, {2.3, 0, 0, 0, 0, 0, 0, 1e-6, 1e-7}};
  const Glass conrady{"5", 5, {1.5, 0.01, 0.002}};
  for (const double nm : {450.0, 589.3, 850.0}) {
    const auto index = [nm](const Glass& glass) { return refractive_index(glass, nm); };
    EXPECT_NEAR(index(six), index(bk7), 1e-14);
    EXPECT_NEAR(index(eleven), index(bk7), 1e-14);
    EXPECT_NEAR(index(four), index(two_terms), 1e-14);
    EXPECT_NEAR(index(nine), index(two_terms), 1e-14);
    EXPECT_NEAR(index(eight), index(one_term), 1e-14);
    EXPECT_NEAR(index(seven), index(one_term), 1e-14);
    EXPECT_NEAR(index(ten), index(schott), 1e-14);
    EXPECT_NEAR(index(twelve), index(schott), 1e-14);
    EXPECT_NEAR(index(thirteen), index(schott), 1e-14);
    EXPECT_NEAR(index(twelve_high), index(thirteen_high), 1e-14);
    EXPECT_NEAR(index(ten_low), index(thirteen_low), 1e-14);
    EXPECT_NEAR(index(conrady), 1.5 + 0.01 / (nm / 1000) + 0.002 * std::pow(nm / 1000, -3.5), 1e-14);
  }
  // Herzberger: Zemax's form, by hand at 1 micrometre: L = 1 / 0.972.
  const double l = 1 / 0.972;
  EXPECT_NEAR(refractive_index({"3", 3, {1.4, 0.01, 0.001, 0.02, 0.002, 0.0002}}, 1000),
              1.4 + 0.01 * l + 0.001 * l * l + 0.0222, 1e-14);
}

TEST(Glass, CodesReproduceNdAndVd) {
  const auto short_code = glass_of_code("517642");
  ASSERT_TRUE(short_code);
  EXPECT_DOUBLE_EQ(refractive_index(*short_code, kD), 1.517);
  EXPECT_NEAR(abbe(*short_code), 64.2, 1e-6);
  const auto long_code = glass_of_code("487490.704058");
  ASSERT_TRUE(long_code);
  EXPECT_DOUBLE_EQ(refractive_index(*long_code, kD), 1.487490);
  EXPECT_NEAR(abbe(*long_code), 70.4058, 1e-6);
  for (const char* none : {"N-BK7", "51764", "5176420", "517.64x", "000000", "517642.", ".517"})
    EXPECT_FALSE(glass_of_code(none)) << none;
}

// The paper's listing prints the indices of its four fictitious glasses at 589 nm.
TEST(Glass, CodesMatchThePapersListing) {
  const std::map<std::string, double> listing = {{"487490.704058", 1.487439},
                                                 {"755201.275795", 1.755004},
                                                 {"754014.287340", 1.753825},
                                                 {"555520.458240", 1.555431}};
  for (const auto& [code, index] : listing)
    EXPECT_NEAR(refractive_index(*glass_of_code(code), 589), index, 1e-5) << code;
}

TEST(Glass, ReportsMistakes) {
  EXPECT_EQ(complaint(R"({"nd": 1.5, "vd": 60})"), "accepted");
  EXPECT_EQ(complaint(R"({"agf_formula": 2, "coefficients": [1, 0.01, 0.2, 0.02, 1, 100, 0, 0, 0, 0]})"), "accepted");
  EXPECT_THAT(complaint(R"({})"), HasSubstr("are missing"));
  EXPECT_THAT(complaint(R"({"nd": 1.5})"), HasSubstr("missing key 'vd'"));
  EXPECT_THAT(complaint(R"({"nd": 0.9, "vd": 60})"),
              HasSubstr("g.json:1:26: /glasses/G/nd: expected a number from 1.0001"));
  EXPECT_THAT(complaint(R"({"nd": 1.5, "vd": 60, "agf_formula": 2})"), HasSubstr("give either"));
  EXPECT_THAT(complaint(R"({"agf_formula": 14, "coefficients": [1]})"), HasSubstr("from 1 to 13, found 14"));
  EXPECT_THAT(complaint(R"({"agf_formula": 5, "coefficients": [1, 2, 3, 4]})"), HasSubstr("takes 1 to 3"));
  EXPECT_THAT(complaint(R"({"agf_formula": 5, "coefficients": [1, "2"]})"),
              HasSubstr("/glasses/G/coefficients/1: expected a number"));
  EXPECT_THAT(complaint(R"({"agf_formula": 5, "coefficients": [1.5], "vc": 1})"), HasSubstr("unknown key 'vc'"));
  const Glass wrong{"G", 2, {-3, 0.01}};
  try {
    refractive_index(wrong, 589.3);
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("'G' has no refractive index from 1 to 5 at 589.3 nm"));
  }
}

}  // namespace
}  // namespace relign::optics
