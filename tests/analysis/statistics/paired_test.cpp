#include "statistics/paired.h"

#include <gmock/gmock.h>

#include "error_text.h"
#include "statistics/golden.h"

namespace relign::statistics::paired_tests {
namespace {

using test::error_text;
using test::expect_close;
using test::golden;
using test::numbers;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

TEST(SignedRank, MatchesSciPy) {
  for (const auto& one : golden("signed_rank")["cases"]) {
    const std::vector<double> differences = numbers(one["differences"]);
    const SignedRank test = signed_rank(differences);
    SCOPED_TRACE(differences.size());
    EXPECT_EQ(test.n + test.zeros, differences.size());
    EXPECT_EQ(std::min(test.above, test.below), one["statistic"].get<double>());
    expect_close(test.p, one["p"]);
    EXPECT_NEAR(test.p / one["p"].get<double>(), 1, 1e-9);
    EXPECT_EQ(test.exact, test.n <= 50);
  }
}

TEST(SignedRank, HandlesNoneOneAndEqualDifferences) {
  for (const auto& nothing : {std::vector<double>{}, {0, 0}, {kMissing}}) {
    EXPECT_EQ(signed_rank(nothing).n, 0U);
    EXPECT_EQ(signed_rank(nothing).p, 1);
  }
  EXPECT_EQ(signed_rank({0, 0, kMissing}).zeros, 2U);
  EXPECT_EQ(signed_rank({2}).p, 1);
  EXPECT_DOUBLE_EQ(signed_rank(std::vector<double>(6, -1)).p, 2.0 / 64);
  EXPECT_DOUBLE_EQ(signed_rank({1, 2, 3, 4, 5, kInfinite}).p, 2.0 / 64);
  EXPECT_LT(signed_rank(std::vector<double>(200, 1)).p, 1e-40);
  EXPECT_THAT(midranks({3, 1, 3, kInfinite}), ElementsAre(2.5, 1, 2.5, 4));
}

TEST(Paired, DifferencesOfLogarithmsAreRatios) {
  const std::vector<double> differences =
      paired_differences({2, kMissing, 0, kInfinite, 1, 0}, {1, 1, 0, kInfinite, kInfinite, 5}, Scale::logarithmic);
  EXPECT_DOUBLE_EQ(differences[0], std::log(2));
  EXPECT_TRUE(std::isnan(differences[1]));
  EXPECT_EQ(differences[2], 0);
  EXPECT_EQ(differences[3], 0);
  EXPECT_EQ(differences[4], -kInfinite);
  EXPECT_EQ(differences[5], -kInfinite);
  EXPECT_THAT(paired_differences({-2, 3}, {1, 3}, Scale::raw), ElementsAre(-3, 0));
  EXPECT_THAT(error_text(ErrorKind::bad_input,
                         [] {
                           paired_differences({1, 1}, {1, -1}, Scale::logarithmic);
                         }),
              HasSubstr("instance 1 has the negative value -1"));
  EXPECT_THAT(error_text(ErrorKind::internal,
                         [] {
                           paired_differences({1, 1}, {1}, Scale::raw);
                         }),
              HasSubstr("2 and 1 values cannot be paired"));
}

TEST(Paired, VerdictComparesTheIntervalWithTheRelevantDifference) {
  EXPECT_EQ(verdict_of({-0.4, -0.2}, 0.1), Verdict::better);
  EXPECT_EQ(verdict_of({0.2, 0.4}, 0.1), Verdict::worse);
  EXPECT_EQ(verdict_of({-0.1, 0.05}, 0.1), Verdict::practically_equal);
  EXPECT_EQ(verdict_of({-0.4, -0.05}, 0.1), Verdict::undecided);  // lower, but possibly by less than what is relevant
  EXPECT_EQ(verdict_of({-0.4, 0.4}, 0.1), Verdict::undecided);
  EXPECT_EQ(verdict_of({}, 0.1), Verdict::undecided);
  EXPECT_EQ(verdict_of({0, 0}, 0), Verdict::practically_equal);
  EXPECT_EQ(verdict_of({-kInfinite, -kInfinite}, 0.1), Verdict::better);
  EXPECT_EQ(std::string(verdict_name(Verdict::practically_equal)), "practically equal");
  for (const double wrong : {-0.1, kMissing}) {
    EXPECT_THAT(error_text(ErrorKind::bad_input,
                           [&] {
                             verdict_of({0, 1}, wrong);
                           }),
                HasSubstr("must be 0 or a positive"));
  }
}

TEST(Paired, ComparesTwoColumns) {
  std::vector<double> first, second;
  for (int instance = 0; instance < 40; ++instance) {
    const double hard = std::exp(0.2 * instance);
    first.push_back(hard * (instance % 4 == 0 ? 1.1 : 0.8));  // worse on ten of forty
    second.push_back(hard);
  }
  first[3] = kMissing;
  second[5] = first[5];
  PairedOptions options;
  options.smallest_relevant = std::log(1.02);
  const PairedComparison comparison = compare_paired(first, second, Resampling(40, 2000, 1), options);
  EXPECT_EQ(comparison.missing, 1U);
  EXPECT_EQ(comparison.difference.n, 39U);
  EXPECT_LT(comparison.difference.estimate, 0);
  EXPECT_GT(comparison.difference.estimate, std::log(0.8));
  EXPECT_EQ(comparison.verdict, Verdict::better);
  EXPECT_EQ(comparison.test.n, 38U);
  EXPECT_LT(comparison.test.p, 0.001);
  EXPECT_DOUBLE_EQ(comparison.probability_of_improvement.estimate, 28.5 / 39);
  options.smallest_relevant = std::log(2.0);
  EXPECT_EQ(compare_paired(first, second, Resampling(40, 2000, 1), options).verdict, Verdict::practically_equal);
  // With the two exchanged.
  options.smallest_relevant = std::log(1.02);
  const PairedComparison turned = compare_paired(second, first, Resampling(40, 2000, 1), options);
  EXPECT_EQ(turned.verdict, Verdict::worse);
  EXPECT_NEAR(turned.difference.estimate, -comparison.difference.estimate, 1e-12);
  EXPECT_EQ(turned.test.p, comparison.test.p);
}

TEST(Paired, HandlesNoneOneAndEqualColumns) {
  const PairedComparison none = compare_paired({}, {}, Resampling(0, 10, 1));
  EXPECT_EQ(none.verdict, Verdict::undecided);
  EXPECT_TRUE(std::isnan(none.probability_of_improvement.estimate));
  EXPECT_EQ(compare_paired({1}, {2}, Resampling(1, 10, 1)).verdict, Verdict::undecided);
  const PairedComparison copies = compare_paired({1, 2, 3}, {1, 2, 3}, Resampling(3, 10, 1));
  EXPECT_EQ(copies.verdict, Verdict::practically_equal);
  EXPECT_EQ(copies.test.p, 1);
  EXPECT_EQ(copies.probability_of_improvement.estimate, 0.5);
}

}  // namespace
}  // namespace relign::statistics::paired_tests
