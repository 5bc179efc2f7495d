#include "statistics/time_to_target.h"

#include <gmock/gmock.h>

#include "error_text.h"
#include "statistics/bootstrap.h"
#include "statistics/golden.h"
#include "statistics/survival.h"

namespace relign::statistics::time_to_target_tests {
namespace {

using test::error_text;
using test::expect_close;
using test::golden;
using test::number;
using test::numbers;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

TEST(TimesToTargets, AreFirstStepsAtOrBelow) {
  const std::vector<TargetTime> times =
      times_to_targets({0.9, kMissing, 0.5, 0.2, 0.4}, {1, 0.5, 0.3, 0.1, kMissing, kInfinite}, 10);
  const std::vector<double> steps = {0, 2, 3, 10, 10, 0};
  for (std::size_t target = 0; target < steps.size(); ++target) {
    EXPECT_EQ(times[target].steps, steps[target]) << target;
    EXPECT_EQ(times[target].reached, steps[target] < 10) << target;
  }
  EXPECT_FALSE(times_to_targets({kMissing}, {1}, 0).front().reached);
  EXPECT_THAT(error_text(ErrorKind::internal, [] { times_to_targets({}, {1}, 0); }), HasSubstr("leave the trial out"));
  EXPECT_THAT(error_text(ErrorKind::internal, [] { times_to_targets({1, 2, 3}, {1}, 1); }), HasSubstr("or the budget"));
}

TEST(ExpectedSteps, DivideAllStepsBySuccesses) {
  const std::vector<TargetTime> trials = {{3, true}, {20, false}, {7, true}, {20, false}};
  const ExpectedSteps expected = expected_steps(trials);
  EXPECT_EQ(expected.successes, 2U);
  EXPECT_EQ(expected.trials, 4U);
  EXPECT_EQ(expected.steps, 25);
  const ExpectedSteps banded = expected_steps(trials, Resampling(4, 1000, 1));
  EXPECT_EQ(banded.steps, 25);
  EXPECT_GT(banded.interval.low, 2);
  EXPECT_LT(banded.interval.low, 10);
  EXPECT_EQ(banded.interval.high, kInfinite);  // 1 of 16 resamples has no success
}

// With a hundred copies of the trials the interval is that of a ratio of means by the delta method, 25 +- 1.96 * 2.005.
TEST(ExpectedSteps, MatchTheDeltaMethod) {
  std::vector<TargetTime> trials;
  for (int copy = 0; copy < 100; ++copy) trials.insert(trials.end(), {{3, true}, {20, false}, {7, true}, {20, false}});
  const ExpectedSteps expected = expected_steps(trials, Resampling(400, 2000, 1));
  // Residuals steps - 25 reached are -22, 20, -18, 20: standard error sqrt(402 / 400) / 0.5 = 2.005.
  EXPECT_NEAR(expected.interval.low, 25 - 1.96 * 2.005, 0.6);
  EXPECT_NEAR(expected.interval.high, 25 + 1.96 * 2.005, 0.8);
}

TEST(ExpectedSteps, HandleNoTrialsAndNoSuccesses) {
  EXPECT_TRUE(std::isnan(expected_steps(std::vector<TargetTime>{}).steps));
  EXPECT_FALSE(expected_steps({}, Resampling(0, 10, 1)).interval.exists());
  const ExpectedSteps never = expected_steps({{0, false}, {0, false}}, Resampling(2, 10, 1));
  EXPECT_EQ(never.steps, kInfinite);
  EXPECT_EQ(never.interval.low, kInfinite);
  EXPECT_EQ(never.interval.high, kInfinite);
  const ExpectedSteps at_once = expected_steps({{0, true}, {0, true}}, Resampling(2, 10, 1));
  EXPECT_EQ(at_once.steps, 0);
  EXPECT_EQ(at_once.interval.high, 0);
  EXPECT_FALSE(expected_steps({{5, true}}, Resampling(1, 10, 1)).interval.exists());
  EXPECT_THAT(error_text(ErrorKind::internal,
                         [] {
                           expected_steps({{5, true}}, Resampling(2, 10, 1));
                         }),
              HasSubstr("1 values"));
}

TEST(RuntimeEcdf, CountsPairs) {
  const std::vector<TargetTime> pairs = {{0, true}, {4, true}, {4, true}, {9, false}, {30, true}};
  EXPECT_THAT(runtime_ecdf(pairs, {4, -1, 0, 3.9, 9, 1000}), ElementsAre(0.6, 0, 0.2, 0.2, 0.6, 0.8));
  EXPECT_TRUE(std::isnan(runtime_ecdf({}, {4}).front()));
  EXPECT_THAT(runtime_ecdf(pairs, {}), IsEmpty());
}

std::vector<TargetTime> trials_of(const nlohmann::json& one) {
  std::vector<TargetTime> trials;
  for (std::size_t trial = 0; trial < one["steps"].size(); ++trial) {
    trials.push_back({one["steps"][trial].get<double>(), one["reached"][trial].get<bool>()});
  }
  return trials;
}

void expect_same(double value, double expected) {
  if (std::isnan(expected)) return;  // SciPy has no value where the curve is 1 or 0
  expect_close(value, expected);
}

TEST(KaplanMeier, MatchesSciPy) {
  for (const auto& one : golden("survival")["cases"]) {
    const std::vector<SurvivalPoint> curve = kaplan_meier(trials_of(one));
    const std::vector<double> at = numbers(one["at"]);
    ASSERT_EQ(curve.size(), at.size());
    for (std::size_t point = 0; point < at.size(); ++point) {
      EXPECT_EQ(curve[point].steps, at[point]);
      expect_close(curve[point].survival, number(one["survival"][point]));
      expect_same(curve[point].standard_error, number(one["error"][point]));
      expect_same(curve[point].interval.low, number(one["low"][point]));
      expect_same(curve[point].interval.high, number(one["high"][point]));
    }
  }
}

TEST(KaplanMeier, MatchesFreireichsPublishedTable) {
  const auto file = golden("survival");
  const std::vector<SurvivalPoint> curve = kaplan_meier(trials_of(file["cases"][0]));
  for (const auto& row : file["published"]) {
    const auto point = std::find_if(curve.begin(), curve.end(),
                                    [&](const SurvivalPoint& candidate) { return candidate.steps == row[0]; });
    ASSERT_NE(point, curve.end());
    EXPECT_NEAR(point->survival, row[1].get<double>(), 5.1e-4);
    EXPECT_NEAR(point->standard_error, row[2].get<double>(), 5.1e-5);
  }
  const Band median = median_steps(curve);
  EXPECT_EQ(median.n, 21U);
  EXPECT_EQ(median.estimate, file["published_median"].get<double>());
  EXPECT_EQ(median.interval.low, 13);
  EXPECT_EQ(median.interval.high, kInfinite);
}

TEST(KaplanMeier, CountsCensoredTrialsAsAtRisk) {
  const std::vector<SurvivalPoint> curve =
      kaplan_meier({{5, false}, {5, true}, {2, false}, {9, true}, {kMissing, true}});
  ASSERT_EQ(curve.size(), 3U);
  EXPECT_EQ(curve[0].survival, 1);
  EXPECT_EQ(curve[0].interval.low, 1);
  EXPECT_EQ(curve[1].at_risk, 3U);
  EXPECT_EQ(curve[1].reached, 1U);
  EXPECT_EQ(curve[1].censored, 1U);
  EXPECT_DOUBLE_EQ(curve[1].survival, 2.0 / 3);
  EXPECT_EQ(curve[2].survival, 0);
  EXPECT_TRUE(std::isnan(curve[2].standard_error));
  EXPECT_EQ(curve[2].interval.low, 0);
  EXPECT_DOUBLE_EQ(curve[2].interval.high, 2.0 / 3 * 0.975);  // upper limit of 0 of 1
}

// If all trials succeed at the same step, the interval of the median is finite from six trials on: it is that of order
// statistics, whose coverage 1 - 2 / 2^n is 93.8 % for five and 96.9 % for six trials.
TEST(KaplanMeier, HasAFiniteIntervalIfAllSucceedAtOnce) {
  for (const auto& [n, high] : {std::pair{5, kInfinite}, {6, 3.0}, {100, 3.0}}) {
    const Band median = median_steps(kaplan_meier(std::vector<TargetTime>(n, {3, true})));
    EXPECT_EQ(median.estimate, 3);
    EXPECT_EQ(median.interval.low, 3);
    EXPECT_EQ(median.interval.high, high) << n;
  }
}

TEST(KaplanMeier, HasAFiniteIntervalIfTheLastSucceedTogether) {
  // Four of six at step 2, two at step 4: 1/3 * (1 - sqrt(0.025)) is below one half.
  const Band median = median_steps(kaplan_meier({{2, true}, {2, true}, {2, true}, {2, true}, {4, true}, {4, true}}));
  EXPECT_EQ(median.interval.high, 4);
}

TEST(KaplanMeier, HandlesNoneOneAndEqualTrials) {
  EXPECT_THAT(kaplan_meier({}), IsEmpty());
  EXPECT_TRUE(std::isnan(median_steps({}).estimate));
  const Band never = median_steps(kaplan_meier({{5, false}, {5, false}}));
  EXPECT_EQ(never.estimate, kInfinite);
  EXPECT_EQ(never.interval.low, kInfinite);
  const Band once = median_steps(kaplan_meier({{5, true}}));
  EXPECT_EQ(once.estimate, 5);
  EXPECT_EQ(once.interval.low, 5);
  EXPECT_EQ(once.interval.high, kInfinite);
  EXPECT_EQ(median_steps(kaplan_meier({{1, true}, {2, true}, {3, false}, {4, false}})).estimate, 2);
  EXPECT_THAT(error_text(ErrorKind::bad_input, [] { kaplan_meier({}, 0); }), HasSubstr("between 0 and 1"));
}

}  // namespace
}  // namespace relign::statistics::time_to_target_tests
