#include "statistics/bootstrap.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numeric>
#include <relign/random.hpp>

#include "error_text.h"
#include "statistics/golden.h"
#include "statistics/sorted_sample.h"

namespace relign::statistics {
namespace {

using test::error_text;
using test::expect_close;
using test::golden;
using test::number;
using test::numbers;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

const std::vector<std::pair<std::string, OrderStatistic>>& statistics() {
  static const std::vector<std::pair<std::string, OrderStatistic>> all = {{"mean", OrderStatistic::mean()},
                                                                          {"median", OrderStatistic::median()},
                                                                          {"iqm", OrderStatistic::iqm()},
                                                                          {"q90", OrderStatistic::quantile(0.9)}};
  return all;
}

TEST(Bootstrap, MatchesSciPy) {
  const auto file = golden("bootstrap");
  for (const auto& one : file["cases"]) {
    const std::vector<double> values = numbers(one["values"]);
    const Resampling resampling(values.size(), file["resamples"], file["seed"]);
    std::vector<std::uint8_t> scratch;
    for (std::size_t resample = 0; resample < one["counts"].size(); ++resample) {
      const std::uint8_t* counts = resampling.counts(resample, scratch);
      for (std::size_t instance = 0; instance < values.size(); ++instance) {
        ASSERT_EQ(counts[instance], one["counts"][resample][instance].get<int>()) << resample << " " << instance;
      }
    }
    for (const auto& [name, statistic] : statistics()) {
      SCOPED_TRACE(name + " of " + std::to_string(values.size()));
      const auto& expected = one["statistics"][name];
      expect_close(statistic.of(values), number(expected["estimate"]));
      const Replicates replicates = resampled(resampling, {values}, statistic).front();
      for (std::size_t resample = 0; resample < expected["replicates"].size(); ++resample) {
        expect_close(replicates[resample], number(expected["replicates"][resample]));
      }
      const Band band = bands(resampling, {values}, statistic).front();
      expect_close(band.interval.low, number(expected["interval_95"][0]));
      expect_close(band.interval.high, number(expected["interval_95"][1]));
      const Interval narrow = expanded_percentile(replicates, band.n, 0.8);
      expect_close(narrow.low, number(expected["interval_80"][0]));
      expect_close(narrow.high, number(expected["interval_80"][1]));
    }
  }
}

// More counts than are stored, compared with the same draws of a smaller object.
TEST(Bootstrap, RepeatsDrawsThatAreNotStored) {
  constexpr std::size_t kInstances = 1000;
  const Resampling kept(kInstances, 10, 5);
  const Resampling drawn_again(kInstances, Resampling::kKeptBytes / kInstances + 1, 5);
  std::vector<std::uint8_t> one, other;
  for (std::size_t resample = 0; resample < 10; ++resample) {
    const std::uint8_t* left = kept.counts(resample, one);
    const std::uint8_t* right = drawn_again.counts(resample, other);
    EXPECT_TRUE(std::equal(left, left + kInstances, right));
    EXPECT_EQ(std::accumulate(left, left + kInstances, 0U), kInstances);
  }
  EXPECT_TRUE(one.empty());
  EXPECT_EQ(other.size(), kInstances);
}

TEST(Bootstrap, SharesDrawsAcrossColumns) {
  const std::vector<double> hard = {1, 100, 3, 70, 5, 20, 9, 11};
  std::vector<double> harder = hard;
  for (double& value : harder) value += 2;
  const Resampling resampling(hard.size(), 500, 3);
  const std::vector<Replicates> both = resampled(resampling, {hard, harder}, OrderStatistic::mean());
  for (const double value : difference(both[1], both[0])) EXPECT_NEAR(value, 2, 1e-12);
  const Replicates same = ratio(both[0], both[0]);
  EXPECT_EQ(*std::max_element(same.begin(), same.end()), 1);
}

TEST(Bootstrap, HandlesNoneOneTwoAndEqualValues) {
  for (const auto& [name, statistic] : statistics()) {
    SCOPED_TRACE(name);
    const Band none = bands(Resampling(0, 10, 1), {{}}, statistic).front();
    EXPECT_EQ(none.n, 0U);
    EXPECT_TRUE(std::isnan(none.estimate));
    EXPECT_FALSE(none.interval.exists());
    const Band missing = bands(Resampling(2, 10, 1), {{kMissing, kMissing}}, statistic).front();
    EXPECT_EQ(missing.n, 0U);
    EXPECT_FALSE(missing.interval.exists());
    const Band one = bands(Resampling(1, 10, 1), {{4}}, statistic).front();
    EXPECT_EQ(one.n, 1U);
    EXPECT_EQ(one.estimate, 4);
    EXPECT_FALSE(one.interval.exists());
    const Band two = bands(Resampling(2, 1000, 1), {{4, 8}}, statistic).front();
    EXPECT_EQ(two.interval.low, 4);
    EXPECT_EQ(two.interval.high, 8);
    const Band equal = bands(Resampling(7, 100, 1), {std::vector<double>(7, 0.1)}, statistic).front();
    EXPECT_EQ(equal.estimate, 0.1);
    EXPECT_EQ(equal.interval.low, 0.1);
    EXPECT_EQ(equal.interval.high, 0.1);
  }
}

TEST(Bootstrap, IncludesInfiniteValuesWithWeight) {
  const std::vector<double> values = {1, 2, 3, 4, kInfinite};
  EXPECT_EQ(OrderStatistic::median().of(values), 3);
  EXPECT_EQ(OrderStatistic::mean().of(values), kInfinite);
  EXPECT_EQ(OrderStatistic::iqm().of({-kInfinite, 2, 4, kInfinite}), 3);
  EXPECT_TRUE(std::isnan(OrderStatistic::mean().of({-kInfinite, kInfinite})));
  EXPECT_EQ(OrderStatistic::median().of({kInfinite, kInfinite}), kInfinite);
  const Band band = bands(Resampling(5, 1000, 1), {values}, OrderStatistic::median()).front();
  EXPECT_EQ(band.interval.low, 1);
  EXPECT_EQ(band.interval.high, kInfinite);
  const Band low = bands(Resampling(5, 1000, 1), {{-kInfinite, 2, 3, 4, 5}}, OrderStatistic::median()).front();
  EXPECT_EQ(low.interval.low, -kInfinite);
  EXPECT_EQ(low.interval.high, 5);
}

TEST(Bootstrap, IqmCutsFractionsOfValues) {
  // 2.5 of 10 at either end: (3 / 2 + 4 + 5 + 6 + 7 + 80 / 2) / 5.
  EXPECT_DOUBLE_EQ(OrderStatistic::iqm().of({1, 2, 3, 4, 5, 6, 7, 80, 900, 1000}), 12.7);
  EXPECT_DOUBLE_EQ(OrderStatistic::iqm().of({7, 3}), 5);
  EXPECT_DOUBLE_EQ(OrderStatistic::iqm().of({1, 2, 900}), (0.25 * 1 + 2 + 0.25 * 900) / 1.5);
}

TEST(Bootstrap, RejectsInvalidArguments) {
  const Resampling resampling(3, 10, 1);
  EXPECT_THAT(error_text(ErrorKind::bad_input, [] { Resampling(3, 0, 1); }), HasSubstr("at least 1 resample"));
  EXPECT_THAT(error_text(ErrorKind::internal,
                         [&] {
                           resampled(resampling, {{1, 2}}, OrderStatistic::mean());
                         }),
              HasSubstr("column 0 has 2 values for 3 instances"));
  EXPECT_THAT(error_text(ErrorKind::bad_input, [] { OrderStatistic::quantile(1.5); }), HasSubstr("0 to 1"));
  EXPECT_THAT(error_text(ErrorKind::bad_input,
                         [] {
                           expanded_percentile({1, 2}, 2, 95);
                         }),
              HasSubstr("between 0 and 1"));
  EXPECT_THAT(error_text(ErrorKind::internal, [] { difference({1}, {1, 2}); }), HasSubstr("the same Resampling"));
}

// With missing, tied and infinite values, for several quantiles.
TEST(Bootstrap, BlocksOfResamplesMatchSingleResamples) {
  Random random(7, 0);
  for (const std::size_t instances : {1u, 2u, 3u, 10u, 65u, 150u}) {
    const Resampling resampling(instances, 2 * ResampleBlock::kLanes + 5, 3);
    for (int kind = 0; kind < 4; ++kind) {
      std::vector<double> values;
      for (std::size_t i = 0; i < instances; ++i) {
        const double value = random.uniform();
        values.push_back(kind == 1 && value < 0.4   ? kMissing
                         : kind == 2 && value < 0.4 ? kInfinite
                         : kind == 3                ? std::floor(3 * value)
                                                    : value);
      }
      const SortedSample sample(values);
      for (const double share : {0.0, 0.1, 0.5, 0.9, 1.0}) {
        SCOPED_TRACE(std::to_string(instances) + " instances, kind " + std::to_string(kind) + ", quantile " +
                     std::to_string(share));
        const OrderStatistic statistic = OrderStatistic::quantile(share);
        const Replicates found = resampled(resampling, {values}, statistic).front();
        std::vector<std::uint8_t> scratch;
        for (std::size_t resample = 0; resample < resampling.resamples(); ++resample) {
          const double expected = sample.resampled(resampling.counts(resample, scratch), statistic);
          if (std::isfinite(expected)) {
            expect_close(found[resample], expected);
          } else {
            EXPECT_TRUE(found[resample] == expected || (std::isnan(found[resample]) && std::isnan(expected)));
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace relign::statistics
