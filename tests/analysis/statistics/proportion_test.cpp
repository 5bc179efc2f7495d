#include "statistics/proportion.h"

#include <gmock/gmock.h>

#include "error_text.h"
#include "statistics/distributions.h"
#include "statistics/golden.h"

namespace relign::statistics {
namespace {

using test::error_text;
using test::expect_close;
using test::golden;
using test::number;
using testing::HasSubstr;

TEST(Distributions, MatchSciPy) {
  const auto file = golden("distributions");
  for (const auto& one : file["normal_lower"]) expect_close(normal_lower(one[0]), one[1]);
  for (const auto& one : file["normal_quantile"]) expect_close(normal_quantile(one[0]), one[1]);
  for (const auto& one : file["student_t_quantile"]) expect_close(student_t_quantile(one[0], one[1]), one[2]);
  for (const auto& one : file["chi_squared_upper"]) expect_close(chi_squared_upper(one[0], one[1]), one[2]);
  for (const auto& one : file["fisher_f_upper"]) expect_close(fisher_f_upper(one[0], one[1], one[2]), one[3]);
  // Small tails keep their digits.
  EXPECT_NEAR(normal_lower(-8) / file["normal_lower"][0][1].get<double>(), 1, 1e-10);
}

TEST(Distributions, HandleExtremeArguments) {
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(normal_quantile(0), -infinite);
  EXPECT_EQ(student_t_quantile(1, 3), infinite);
  EXPECT_EQ(normal_lower(infinite), 1);
  EXPECT_EQ(chi_squared_upper(infinite, 2), 0);
  EXPECT_EQ(chi_squared_upper(-1e-17, 2), 1);
  EXPECT_EQ(fisher_f_upper(infinite, 2, 2), 0);
  EXPECT_TRUE(std::isnan(normal_lower(kMissing)) && std::isnan(fisher_f_upper(kMissing, 1, 1)));
  EXPECT_THAT(error_text(ErrorKind::internal, [] { normal_quantile(2); }), HasSubstr("0 to 1"));
  EXPECT_THAT(error_text(ErrorKind::internal, [] { chi_squared_upper(1, 0); }), HasSubstr("positive"));
}

TEST(SuccessRate, MatchesSciPy) {
  for (const auto& one : golden("proportion")["cases"]) {
    const Band band = success_rate(one[0], one[1], one[2]);
    EXPECT_EQ(band.n, one[1].get<std::size_t>());
    EXPECT_DOUBLE_EQ(band.estimate, one[0].get<double>() / one[1].get<double>());
    expect_close(band.interval.low, one[3]);
    expect_close(band.interval.high, one[4]);
  }
}

TEST(SuccessRate, StaysWithinZeroAndOne) {
  EXPECT_EQ(success_rate(0, 3).interval.low, 0);
  EXPECT_LT(success_rate(0, 3).interval.high, 0.6);
  EXPECT_EQ(success_rate(3, 3).interval.high, 1);
  EXPECT_EQ(success_rate(0, 0).n, 0U);
  EXPECT_TRUE(std::isnan(success_rate(0, 0).estimate));
  EXPECT_FALSE(success_rate(0, 0).interval.exists());
  EXPECT_EQ(share_of_scores(1.5, 3).estimate, 0.5);
}

TEST(SuccessRate, RejectsInvalidArguments) {
  EXPECT_THAT(error_text(ErrorKind::internal, [] { success_rate(4, 3); }), HasSubstr("of 3 trials are impossible"));
  EXPECT_THAT(error_text(ErrorKind::bad_input, [] { success_rate(1, 3, 1); }), HasSubstr("between 0 and 1"));
}

}  // namespace
}  // namespace relign::statistics
