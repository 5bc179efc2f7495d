// scene tolerances.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

json tolerances(const Workplace& place, std::vector<std::string> more) {
  std::vector<std::string> words{"scene", "tolerances", "--json", "--scene",
                                 R"({"use": "cooke_triplet", "parameters": {"pixels": 100}})"};
  words.insert(words.end(), more.begin(), more.end());
  const Outcome outcome = relign_bench(place, words);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return json::parse(outcome.out);
}

TEST(CliTolerances, PredictWhatASearchFinds) {
  const Workplace place;
  const json found = tolerances(place, {"--noise-level", "tolerances-commercial", "--draws", "200", "--check", "6"});
  ASSERT_EQ(found.at("checked").size(), 6U);
  double predicted = 0, searched = 0;
  for (const json& lens : found.at("checked")) {
    predicted += lens.at("predicted").get<double>() / 6;
    searched += lens.at("found").get<double>() / 6;
  }
  EXPECT_GT(predicted, 5e-5);
  EXPECT_NEAR(searched / predicted, 1, 0.4);
  double shares = 0;
  for (const json& offset : found.at("offsets")) {
    shares += offset.at("share").get<double>();
    EXPECT_LT(offset.at("rmse_aligned"), offset.at("rmse_at_nominal")) << offset;
  }
  EXPECT_NEAR(shares, 1, 1e-9);
  EXPECT_EQ(found.at("offsets").size(), 15U);
}

// The RMSE of a lens grows with its tolerances in proportion, and the yield falls.
TEST(CliTolerances, FollowTheTolerances) {
  const Workplace place;
  const auto of = [&](double um) {
    place.write("level.json", json{{"use", "tolerances"},
                                   {"limits_are_sigmas", 3},
                                   {"start", {{"shift_um", {200, 200, 150}}, {"tilt_arcmin", {60, 60}}}},
                                   {"elements", {{"L2", {{"shift_um", {um, um, um}}, {"tilt_arcmin", {0, 0}}}}}}}
                                  .dump());
    return tolerances(place, {"--noise-level", "level.json", "--draws", "500", "--check", "0", "--spec", "0.00005"});
  };
  const json fine = of(30), coarse = of(60);
  const double ratio = coarse.at("rmse").at("median").get<double>() / fine.at("rmse").at("median").get<double>();
  EXPECT_NEAR(ratio, 2, 1e-6);
  EXPECT_GT(fine.at("specification").at("yield"), coarse.at("specification").at("yield"));
}

// Tilts of degrees: effects of second order are strong, and some best poses are outside the travel.
TEST(CliTolerances, WarnWhereSearchesContradictThem) {
  const Workplace place;
  const Outcome outcome =
      relign_bench(place, {"scene", "tolerances", "--noise-level", R"({"use": "rho", "parameters": {"level": 2}})",
                           "--draws", "200", "--check", "3", "--spec", "0.0142"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("Warning: 2 of 3 miss the specification that they are predicted to meet."));
  EXPECT_THAT(outcome.out, HasSubstr("14 of them have their best pose outside the travel."));
}

TEST(CliTolerances, RefuseWhatTheyCannotPredict) {
  const Workplace place;
  const Outcome spot = relign_bench(place, {"scene", "tolerances", "--scene", "gaussian_spot"});
  EXPECT_EQ(spot.exit_code, 2);
  EXPECT_THAT(spot.err, HasSubstr("the images of 'gaussian_spot' have no derivatives"));
  const Outcome noise = relign_bench(place, {"scene", "tolerances", "--scene", "relign_l3", "--noise-level",
                                             "tolerances-precision", "--draws", "50", "--check", "0"});
  EXPECT_EQ(noise.exit_code, 2) << "64 rays a pixel are too few for f/0.4";
  EXPECT_THAT(noise.err, HasSubstr("the noise of the derivatives hides what alignment leaves; try 1024"));
  const Outcome spec = relign_bench(place, {"scene", "tolerances", "--spec", "nan"});
  EXPECT_EQ(spec.exit_code, 2);
  const Outcome level = relign_bench(place, {"scene", "tolerances", "--noise-level", "rho0"});
  EXPECT_EQ(level.out, "This noise level moves no element.\n");
}

}  // namespace
}  // namespace relign::cli_test
