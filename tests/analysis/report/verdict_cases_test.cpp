#include "report/verdict_cases.h"

#include <gmock/gmock.h>

namespace relign::report {
namespace {

using testing::HasSubstr;

Pair pair(std::size_t n, double ratio, double low, double high, statistics::Verdict verdict) {
  Pair made;
  made.a = "x";
  made.b = "y";
  made.n = n;
  made.ratio = ratio;
  made.interval = {low, high};
  made.verdict = verdict;
  return made;
}
std::string sentence(const Pair& of) { return verdict_sentence(of, 1.1); }

TEST(VerdictCases, Better) {
  const Pair of = pair(20, 0.5, 0.4, 0.6, statistics::Verdict::better);
  EXPECT_EQ(sentence(of),
            "x is better: paired by instance, the error of x is 0.50 times that of y (95 % CI 0.40 to 0.60)");
  EXPECT_EQ(undecided_reason(of, 1.1), "");
}

TEST(VerdictCases, Worse) {
  const Pair of = pair(20, 2, 1.5, 2.5, statistics::Verdict::worse);
  EXPECT_EQ(sentence(of), "x is worse: paired by instance, the error of x is 2.0 times that of y (95 % CI 1.5 to 2.5)");
  EXPECT_EQ(undecided_reason(of, 1.1), "");
}

TEST(VerdictCases, PracticallyEqual) {
  const Pair of = pair(20, 1.01, 0.98, 1.04, statistics::Verdict::practically_equal);
  EXPECT_EQ(sentence(of),
            "The two are practically equal: paired by instance, the error of x is 1.0 times that of y (95 % CI 0.98 to "
            "1.0), within the smallest relevant ratio of 1.10");
}

// Also with a small ratio and a narrow interval.
TEST(VerdictCases, TooFewInstances) {
  const Pair of = pair(3, 0.14, 0.1, 0.15, statistics::Verdict::undecided);
  EXPECT_EQ(case_of(of, 1.1), VerdictCase::too_few_instances);
  EXPECT_EQ(undecided_reason(of, 1.1), "at least 6 common instances are needed, found 3");
  EXPECT_THAT(sentence(of), HasSubstr("(95 % CI 0.10 to 0.15); at least 6 common instances"));
  EXPECT_THAT(undecided_reason(pair(1, 0.14, kMissing, kMissing, statistics::Verdict::undecided), 1.1),
              HasSubstr("found 1"));
}

TEST(VerdictCases, NoInterval) {
  const Pair of = pair(8, kMissing, kMissing, kMissing, statistics::Verdict::undecided);
  EXPECT_EQ(case_of(of, 1.1), VerdictCase::no_interval);
  EXPECT_EQ(sentence(of), "The comparison is undecided: there is no 95 % interval");
}

TEST(VerdictCases, MayBeBetter) {
  const Pair of = pair(20, 0.9, 0.8, 1.05, statistics::Verdict::undecided);
  EXPECT_EQ(case_of(of, 1.1), VerdictCase::may_be_better);
  EXPECT_THAT(undecided_reason(of, 1.1),
              HasSubstr("the interval crosses 0.909, so better and practically equal are both possible"));
}

TEST(VerdictCases, MayBeWorse) {
  const Pair of = pair(20, 1.1, 0.95, 1.2, statistics::Verdict::undecided);
  EXPECT_EQ(case_of(of, 1.1), VerdictCase::may_be_worse);
  EXPECT_THAT(undecided_reason(of, 1.1),
              HasSubstr("the interval crosses 1.10, so worse and practically equal are both possible"));
}

TEST(VerdictCases, MayBeEither) {
  const Pair of = pair(20, 1, 0.5, 2, statistics::Verdict::undecided);
  EXPECT_EQ(case_of(of, 1.1), VerdictCase::may_be_either);
  EXPECT_THAT(undecided_reason(of, 1.1), HasSubstr("crosses both 0.909 and 1.10"));
}

TEST(VerdictCases, TurnedExchangesTheSides) {
  const Pair of = turned(pair(20, 0.5, 0.4, 0.8, statistics::Verdict::better));
  EXPECT_EQ(of.a, "y");
  EXPECT_EQ(of.verdict, statistics::Verdict::worse);
  EXPECT_DOUBLE_EQ(of.ratio, 2);
  EXPECT_DOUBLE_EQ(of.interval.low, 1.25);
  EXPECT_DOUBLE_EQ(of.interval.high, 2.5);
}

}  // namespace
}  // namespace relign::report
