#include "statistics/paired_shares.h"

#include <gmock/gmock.h>

#include "error_text.h"

namespace relign::statistics {
namespace {

using test::error_text;
using testing::HasSubstr;

PairedShares of_counts(std::size_t both, std::size_t first_alone, std::size_t second_alone, std::size_t none = 0) {
  std::vector<bool> first, second;
  const auto add = [&](std::size_t n, bool a, bool b) {
    first.insert(first.end(), n, a);
    second.insert(second.end(), n, b);
  };
  add(both, true, true);
  add(first_alone, true, false);
  add(second_alone, false, true);
  add(none, false, false);
  return compare_shares(first, second);
}

TEST(PairedShares, CountsPassesOfBoth) {
  const PairedShares shares = of_counts(46, 4, 34, 16);
  EXPECT_EQ(shares.n, 100U);
  EXPECT_EQ(shares.first, 50U);
  EXPECT_EQ(shares.second, 80U);
  EXPECT_EQ(shares.first_alone, 4U);
  EXPECT_EQ(shares.second_alone, 34U);
}

// scipy.stats.binomtest(min(b, c), b + c).pvalue, SciPy 1.17.
TEST(PairedShares, MatchesSciPy) {
  struct Case {
    std::size_t first, second;
    double p;
  };
  for (const Case& one : {Case{34, 4, 6.038535502739251e-07},
                          {1, 0, 1},
                          {5, 0, 0.0625},
                          {0, 6, 0.03125},
                          {3, 3, 1},
                          {2, 10, 0.03857421875},
                          {80, 60, 0.1079876299835527}})
    EXPECT_NEAR(of_counts(7, one.first, one.second).p / one.p, 1, 1e-12) << one.first << " and " << one.second;
}

TEST(PairedShares, IgnoresEqualOutcomes) {
  EXPECT_EQ(of_counts(5, 0, 0, 5).p, 1);
  EXPECT_EQ(of_counts(500, 0, 6).p, of_counts(0, 0, 6).p);
  EXPECT_TRUE(std::isnan(compare_shares({}, {}).p));
  EXPECT_THAT(error_text(ErrorKind::internal, [] { compare_shares({true}, {}); }), HasSubstr("1 and 0 instances"));
}

}  // namespace
}  // namespace relign::statistics
