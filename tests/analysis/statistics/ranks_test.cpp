#include "statistics/ranks.h"

#include <gmock/gmock.h>

#include "error_text.h"
#include "statistics/golden.h"

namespace relign::statistics::rank_tests {
namespace {

using test::error_text;
using test::expect_close;
using test::golden;
using test::number;
using test::numbers;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

std::vector<std::vector<double>> columns_of(const nlohmann::json& one) {
  std::vector<std::vector<double>> columns;
  for (const auto& column : one["columns"]) columns.push_back(numbers(column));
  return columns;
}

TEST(Friedman, MatchesSciPy) {
  for (const auto& one : golden("ranks")["cases"]) {
    const Friedman test = friedman(columns_of(one));
    for (std::size_t column = 0; column < test.mean_ranks.size(); ++column) {
      expect_close(test.mean_ranks[column], number(one["mean_ranks"][column]));
    }
    expect_close(test.chi_squared, number(one["chi_squared"]));
    expect_close(test.p, number(one["p"]));
    expect_close(test.f, number(one["f"]));
    expect_close(test.f_p, number(one["f_p"]));
  }
}

TEST(Friedman, MatchesDemsarsPublishedRanks) {
  const auto file = golden("ranks");
  const Friedman test = friedman(columns_of(file["cases"][0]));
  double squares = 0;
  for (std::size_t column = 0; column < 4; ++column) {
    EXPECT_NEAR(test.mean_ranks[column], number(file["demsar_mean_ranks"][column]), 5.1e-4);
    squares += test.mean_ranks[column] * test.mean_ranks[column];
  }
  EXPECT_NEAR(12.0 * 14 / 20 * (squares - 4 * 25 / 4.0), number(file["demsar_chi_squared_without_ties"]), 5.1e-3);
}

TEST(Friedman, HandlesTiesAndMissingValues) {
  const Friedman alike = friedman({{1, 2, 3}, {2, 3, 4}, {3, 4, kInfinite}});
  EXPECT_DOUBLE_EQ(alike.chi_squared, 6);
  EXPECT_EQ(alike.f, kInfinite);
  EXPECT_EQ(alike.f_p, 0);
  const Friedman tied = friedman({{1, 2}, {1, 2}});
  EXPECT_EQ(tied.chi_squared, 0);
  EXPECT_EQ(tied.p, 1);
  EXPECT_EQ(tied.f_p, 1);
  EXPECT_THAT(tied.mean_ranks, ElementsAre(1.5, 1.5));
  const Friedman gaps = friedman({{1, kMissing, 3}, {2, 3, kMissing}});
  EXPECT_EQ(gaps.instances, 1U);
  EXPECT_EQ(gaps.left_out, 2U);
  EXPECT_TRUE(std::isnan(gaps.f));
  EXPECT_FALSE(std::isnan(gaps.p));
  EXPECT_TRUE(std::isnan(friedman({}).p));
  EXPECT_TRUE(std::isnan(friedman({{}, {}}).p));
  EXPECT_TRUE(std::isnan(friedman({{1, 2}}).p));
  EXPECT_THAT(error_text(ErrorKind::internal, [] { friedman({{1, 2}, {1}}); }), HasSubstr("2 and 1 values"));
}

// By hand: sorted p times 4, 3, 2, 1, never falling, at most 1.
TEST(Holm, MatchesHandCalculation) {
  const std::vector<double> corrected = holm({0.01, 0.04, 0.03, 0.005});
  EXPECT_DOUBLE_EQ(corrected[3], 0.02);
  EXPECT_DOUBLE_EQ(corrected[0], 0.03);
  EXPECT_DOUBLE_EQ(corrected[2], 0.06);
  EXPECT_DOUBLE_EQ(corrected[1], 0.06);
  EXPECT_THAT(holm({0.9, 0.8}), ElementsAre(1, 1));
  EXPECT_THAT(holm({}), testing::IsEmpty());
  const std::vector<double> gap = holm({kMissing, 0.03});
  EXPECT_TRUE(std::isnan(gap[0]));
  EXPECT_EQ(gap[1], 0.03);
}

}  // namespace
}  // namespace relign::statistics::rank_tests
