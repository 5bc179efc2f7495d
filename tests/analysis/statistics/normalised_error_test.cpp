#include "statistics/normalised_error.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "statistics/rmse.h"

namespace relign::statistics {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;

const double kResolution = kRmse.resolution;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::vector<records::StepNumbers> steps(const std::vector<double>& recommended_mse, double start_mse) {
  std::vector<records::StepNumbers> made(recommended_mse.size());
  for (std::size_t step = 0; step < made.size(); ++step) {
    made[step].step = static_cast<unsigned>(step);
    made[step].commanded_mse = step == 0 ? start_mse : 1;  // of step 0 alone
    made[step].recommended_mse = recommended_mse[step];
  }
  return made;
}

TEST(NormalisedError, IsTheShareOfRemainingDecades) {
  EXPECT_DOUBLE_EQ(normalised_error(0.1, 0.1, kResolution), 1);
  EXPECT_DOUBLE_EQ(normalised_error(0.01, 0.1, kResolution), 2.0 / 3);
  EXPECT_DOUBLE_EQ(normalised_error(0.001, 0.1, kResolution), 1.0 / 3);
  EXPECT_DOUBLE_EQ(normalised_error(0.0001, 0.1, kResolution), 0);
  EXPECT_DOUBLE_EQ(normalised_error(0.001, 0.01, kResolution), 0.5);
}

// COCO's view: log-uniform targets between start and resolution; those below the error are missed.
TEST(NormalisedError, IsTheShareOfMissedLogUniformTargets) {
  constexpr int kTargets = 100'000;
  for (const double excess : {0.00013, 0.002, 0.0306}) {
    int missed = 0;
    for (int target = 0; target < kTargets; ++target)
      missed += excess > kResolution * std::pow(0.04 / kResolution, (target + 0.5) / kTargets) ? 1 : 0;
    EXPECT_NEAR(normalised_error(excess, 0.04, kResolution), static_cast<double>(missed) / kTargets, 1e-5) << excess;
  }
}

TEST(NormalisedError, IsClampedBetweenResolutionAndStart) {
  EXPECT_EQ(normalised_error(0, 0.1, kResolution), 0);
  EXPECT_EQ(normalised_error(kResolution / 2, 0.1, kResolution), 0);
  EXPECT_EQ(normalised_error(0.5, 0.1, kResolution), 1);
  EXPECT_EQ(normalised_error(std::numeric_limits<double>::infinity(), 0.1, kResolution), 1);
}

TEST(NormalisedError, IsNaNIfNotMeasurable) {
  EXPECT_TRUE(std::isnan(normalised_error(kNone, 0.1, kResolution)));
  EXPECT_TRUE(std::isnan(normalised_error(0.1, kNone, kResolution)));
  EXPECT_TRUE(std::isnan(normalised_error(0.1, kResolution, kResolution)));
  EXPECT_TRUE(std::isnan(normalised_error(0.1, 0, kResolution)));
}

// The own optimum (MSE 1e-4) is subtracted from the MSE, not from the RMSE.
TEST(NormalisedError, UsesTheRecommendedPoseAndTheStart) {
  const double own = 1e-4;
  EXPECT_THAT(
      normalised_errors(steps({own + 1e-2, own + 1e-4, own - 1e-9, own + 4e-2}, own + 1e-2), own, Rule::own, kRmse),
      ElementsAre(DoubleNear(1, 1e-12), DoubleNear(2.0 / 3, 1e-12), 0, 1));
  EXPECT_TRUE(normalised_errors({}, own, Rule::own, kRmse).empty());
  const std::vector<double> unknown = normalised_errors(steps({1e-2, kNone}, 1e-2), 0, Rule::own, kRmse);
  EXPECT_DOUBLE_EQ(unknown[0], 1);
  EXPECT_TRUE(std::isnan(unknown[1]));
  EXPECT_TRUE(std::isnan(normalised_errors(steps({1e-2}, 1e-2), kNone, Rule::own, kRmse).front()));
  std::vector<records::StepNumbers> without_start = steps({1e-2, 1e-3}, 1e-2);
  without_start.erase(without_start.begin());
  EXPECT_TRUE(std::isnan(normalised_errors(without_start, 0, Rule::own, kRmse).front()));
}

// Step 1 has the lowest measured error, step 2 does not, step 3 has none.
TEST(NormalisedError, UsesThePoseOfTheRule) {
  std::vector<records::StepNumbers> trial = steps({1e-2, 1e-2, 1e-2, 1e-2}, 1e-2);
  const double measured[] = {0.2, 0.1, 0.15, kNone}, glued[] = {1e-2, 1e-4, 1e-6, 1e-2};
  for (std::size_t step = 0; step < trial.size(); ++step) {
    trial[step].measured = measured[step];
    trial[step].glued_mse = glued[step];
  }
  EXPECT_THAT(normalised_errors(trial, 0, Rule::own, kRmse), ElementsAre(1, 1, 1, 1));
  EXPECT_THAT(normalised_errors(trial, 0, Rule::best, kRmse),
              ElementsAre(1, DoubleNear(2.0 / 3, 1e-12), DoubleNear(2.0 / 3, 1e-12), DoubleNear(2.0 / 3, 1e-12)));
  EXPECT_THAT(normalised_errors(trial, 0, Rule::current, kRmse),
              ElementsAre(1, DoubleNear(2.0 / 3, 1e-12), DoubleNear(1.0 / 3, 1e-12), 1));
}

TEST(AreaUnder, AveragesTheStepsAfterTheStart) {
  EXPECT_DOUBLE_EQ(area_under({1, 0.5, 0.1}, 2), 0.3);
  EXPECT_DOUBLE_EQ(area_under({1, 0.5, 0.1}, 4), (0.5 + 0.1 + 0.1 + 0.1) / 4) << "the last value is carried forward";
  EXPECT_DOUBLE_EQ(area_under({0.8}, 3), 0.8) << "an algorithm that never moved";
  EXPECT_TRUE(std::isnan(area_under({}, 3)));
  EXPECT_TRUE(std::isnan(area_under({1}, 0)));
  EXPECT_TRUE(std::isnan(area_under({1, kNone}, 3)));
}

}  // namespace
}  // namespace relign::statistics
