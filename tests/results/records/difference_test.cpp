#include "records/difference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sample_records.h"

namespace relign::records {
namespace {

TEST(Compare, FindsNoDifferenceInEqualRecords) {
  TrialRecord a = sample_trial("t"), b = a;
  EXPECT_FALSE(first_difference(a, b));
  a.steps[1].commanded_mse = b.steps[1].commanded_mse = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(first_difference(a, b));
  b.steps[1].commanded_mse = std::numeric_limits<double>::infinity();  // null in a file, too
  EXPECT_FALSE(first_difference(a, b));
}

TEST(Compare, ReportsFirstDifferenceAsWrittenInTheFile) {
  const TrialRecord a = sample_trial("t");
  TrialRecord b = a;
  b.end = "finished";
  b.steps[2].merit = 9;
  b.steps[1].true_pose[1] = std::nextafter(a.steps[1].true_pose[1], 1);
  const auto difference = first_difference(a, b);
  ASSERT_TRUE(difference);
  EXPECT_EQ(to_string(*difference), "step 1, true_pose[1]: was 0.1, is 0.10000000000000002");
  b = a;
  b.end = "finished";
  EXPECT_EQ(to_string(*first_difference(a, b)), "closing line, end: was budget_spent, is finished");
  b = a;
  b.steps.pop_back();
  EXPECT_EQ(to_string(*first_difference(a, b)), "closing line, steps: was 3, is 2");
}

TEST(Compare, DistinguishesSignedZeros) {
  TrialRecord a = sample_trial("t"), b = a;
  a.steps[0].merit = 0.0;
  b.steps[0].merit = -0.0;
  EXPECT_EQ(to_string(*first_difference(a, b)), "step 0, merit: was 0, is -0.0");
}

TEST(Compare, LeavesOutColumnsThatTheOlderBuildDidNotHave) {
  const Column humidity{"humidity", "%", "", kOptional | kLater}, uncured{"uncured_mse", "MSE", "", kOptional};
  std::vector<double> glued = {1, 2};
  double was = kUnknown, is = 44;
  LaterColumns later;
  later.add(humidity, was);
  later.add(uncured, was);
  later.clear(humidity, is);
  later.clear(Column{"glued_mse", "MSE", "", kLater}, glued);
  EXPECT_TRUE(std::isnan(is) && glued.empty());
  EXPECT_THAT(later.cleared(), testing::ElementsAre("glued_mse", "humidity"));
  is = 44;
  later.clear(uncured, is);
  EXPECT_EQ(is, 44) << "deleted from the record, since every build has this column";
  later.add(humidity, 43.0);  // at another step
  later.clear(humidity, is);
  EXPECT_EQ(is, 44) << "deleted from one step, or different";
  EXPECT_EQ(to_string(NotCompared{{"dew_point", 2}, {"humidity", 1}}),
            "'dew_point' of 2 trials, 'humidity' of 1 trial");
}

TEST(Compare, FindsDeletedValuesOfToday) {
  const TrialRecord whole = sample_trial("t");
  TrialRecord cut = whole, replay = whole;
  replay.scores.uncured_mse[Rule::own] = 0.25;
  EXPECT_TRUE(clear_later(cut, replay).empty());
  EXPECT_EQ(first_difference(cut, replay)->field, "uncured_mse");
}

TEST(Compare, AppliesToleranceToFiniteNumbersOnly) {
  const TrialRecord a = sample_trial("t");
  TrialRecord b = a;
  b.steps[2].measured += 1e-7;
  EXPECT_TRUE(first_difference(a, b));
  EXPECT_FALSE(first_difference(a, b, 1e-6));
  EXPECT_NEAR(largest_difference(a, b), 1e-7, 2e-9);
  b.steps[2].measured += 1e-4;
  EXPECT_TRUE(first_difference(a, b, 1e-6));
  b = a;
  b.steps[2].measured = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(first_difference(a, b, 1e-6));
  b = a;
  b.steps[2].recommendation = "current";
  EXPECT_TRUE(first_difference(a, b, 1e-6));
}

}  // namespace
}  // namespace relign::records
