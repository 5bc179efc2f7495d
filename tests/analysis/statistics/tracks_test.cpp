#include "statistics/tracks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "statistics/rmse.h"

namespace relign::statistics {
namespace {

using testing::DoubleEq;
using testing::ElementsAre;
using testing::IsNan;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// RMSE of 0.5, 0.625 and 0.125 at the commanded, 0.5, 0.5 and 0.125 at the recommended pose.
std::vector<records::StepNumbers> steps() {
  std::vector<records::StepNumbers> list(3);
  const double measured[] = {0.5, 0.75, 0.25}, commanded[] = {0.5, 0.625, 0.125}, recommended[] = {0.5, 0.5, 0.125};
  for (unsigned number = 0; number < 3; ++number) {
    list[number].step = number;
    list[number].measured = measured[number];
    list[number].commanded_mse = commanded[number] * commanded[number];
    list[number].recommended_mse = recommended[number] * recommended[number];
    list[number].glued_mse = commanded[number] * commanded[number];
  }
  return list;
}

TEST(Tracks, AreAsRecordedForAnotherScore) {
  SceneScore loss;
  loss.squared = false;
  std::vector<records::StepNumbers> some = steps();
  some[1].recommended_mse = -0.01;  // an estimate near 0
  EXPECT_THAT(track_values(some, 0, Track::recommended, loss), ElementsAre(0.25, 0, 0.015625));
  EXPECT_THAT(track_values(some, 0, Track::measured, loss), ElementsAre(0.5, 0.75, 0.25));
  EXPECT_THAT(track_values(steps(), 0.125, Track::excess, loss), ElementsAre(0.125, 0.125, 0));
}

TEST(Tracks, FollowTheirDefinitions) {
  EXPECT_THAT(track_values(steps(), 0, Track::measured, kRmse), ElementsAre(0.5, 0.75, 0.25));
  EXPECT_THAT(track_values(steps(), 0, Track::best, kRmse), ElementsAre(0.5, 0.5, 0.25));
  EXPECT_THAT(track_values(steps(), 0, Track::commanded, kRmse), ElementsAre(0.5, 0.625, 0.125));
  EXPECT_THAT(track_values(steps(), 0, Track::recommended, kRmse), ElementsAre(0.5, 0.5, 0.125));
  EXPECT_THAT(track_values(steps(), 0, Track::excess, kRmse), ElementsAre(0.5, 0.5, 0.125));
  EXPECT_TRUE(track_values({}, 0, Track::measured, kRmse).empty());
}

// The pose with the lowest measured error is scored noise-free, which need not give the lowest noise-free error.
TEST(Tracks, ScoreThePoseOfTheRule) {
  std::vector<records::StepNumbers> some = steps();
  some[2].measured = 0.6;
  some[2].glued_mse = 0.04;
  EXPECT_THAT(track_values(some, 0, Track::recommended_current, kRmse), ElementsAre(0.5, 0.625, DoubleEq(0.2)));
  EXPECT_THAT(track_values(some, 0, Track::recommended_best, kRmse), ElementsAre(0.5, 0.5, 0.5));
  some[1].measured = 0.5;
  EXPECT_EQ(best_step(some), 0U) << "the first of equal ones";
  some[1].measured = 0.4;
  EXPECT_THAT(track_values(some, 0, Track::recommended_best, kRmse), ElementsAre(0.5, 0.625, 0.625));
  some[1].glued_mse = kNaN;
  EXPECT_THAT(track_values(some, 0, Track::recommended_best, kRmse), ElementsAre(0.5, IsNan(), IsNan()));
}

TEST(Tracks, ScoreGoingBackToTheBestPoseAsAMoveOfItsOwn) {
  std::vector<records::StepNumbers> some = steps();
  const double best[] = {0.25, 0.16, 0.01};
  for (std::size_t i = 0; i < 3; ++i) some[i].best_mse = best[i];
  EXPECT_THAT(track_values(some, 0, Track::recommended_best, kRmse), ElementsAre(0.5, DoubleEq(0.4), DoubleEq(0.1)));
  EXPECT_THAT(track_values(some, 0, Track::recommended_current, kRmse), ElementsAre(0.5, 0.625, 0.125));
}

TEST(Tracks, ExcessNeedsTheOwnOptimum) {
  EXPECT_THAT(track_values(steps(), kNaN, Track::excess, kRmse), ElementsAre(IsNan(), IsNan(), IsNan()));
  EXPECT_THAT(track_values(steps(), 0.125 * 0.125, Track::excess, kRmse),
              ElementsAre(DoubleEq(std::sqrt(0.25 - 0.015625)), DoubleEq(std::sqrt(0.25 - 0.015625)), 0));
}

TEST(Tracks, ClipNegativeMseAndKeepNaN) {
  std::vector<records::StepNumbers> some = steps();
  some[1].recommended_mse = -1e-9;
  some[2].recommended_mse = kNaN;
  some[0].measured = kNaN;
  EXPECT_THAT(track_values(some, 0, Track::recommended, kRmse), ElementsAre(0.5, 0, IsNan()));
  EXPECT_THAT(track_values(some, 0, Track::best, kRmse), ElementsAre(IsNan(), 0.75, 0.25));
}

}  // namespace
}  // namespace relign::statistics
