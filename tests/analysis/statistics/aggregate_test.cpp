#include "statistics/aggregate.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numeric>

#include "error_text.h"
#include "statistics/golden.h"

namespace relign::statistics {
namespace {

using test::error_text;
using test::expect_close;
using test::golden;
using test::number;
using test::numbers;
using testing::HasSubstr;

StratifiedValues values_of(const nlohmann::json& strata, std::size_t trainings) {
  StratifiedValues values;
  values.trainings = trainings;
  for (const auto& stratum : strata) values.strata.push_back(numbers(stratum));
  return values;
}

MethodErrors errors(std::vector<std::vector<double>> strata, std::size_t trainings = 1) {
  const StratifiedValues values = {trainings, std::move(strata)};
  return {values, values};
}

Aggregates aggregated(const StratifiedResampling& resampling, const std::vector<MethodErrors>& methods) {
  Parallel parallel(2);
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  if (methods.size() > 1) pairs.emplace_back(0, 1);
  return aggregate(resampling, methods, pairs, parallel);
}

// Estimates and intervals by rliable's own functions, over the same draws.
TEST(Aggregate, MatchesRliable) {
  const auto file = golden("aggregate");
  for (const auto& one : file["cases"]) {
    SCOPED_TRACE(one["instances"].dump() + " instances, trainings " + one["trainings"].dump());
    const StratifiedResampling resampling(one["instances"].get<std::vector<std::size_t>>(), file["resamples"],
                                          file["seed"]);
    std::vector<MethodErrors> methods;
    for (std::size_t method = 0; method < 2; ++method) {
      const StratifiedValues values = values_of(one["errors"][method], one["trainings"][method]);
      methods.push_back({values, values});
    }
    const Aggregates found = aggregated(resampling, methods);
    const std::vector<double> places = profile_places();
    for (std::size_t method = 0; method < 2; ++method) {
      const AggregateBands& bands = found.methods[method];
      std::vector<Band> all = {bands.iqm, bands.median, bands.gap};
      for (const double place : numbers(file["places"])) {
        const auto at = std::find(places.begin(), places.end(), place);
        ASSERT_NE(at, places.end()) << place;
        all.push_back(bands.profile[static_cast<std::size_t>(at - places.begin())]);
      }
      const auto& expected = one["methods"][method];
      ASSERT_EQ(all.size(), expected["estimate"].size());
      for (std::size_t i = 0; i < all.size(); ++i) {
        SCOPED_TRACE("statistic " + std::to_string(i) + " of method " + std::to_string(method));
        expect_close(all[i].estimate, number(expected["estimate"][i]));
        expect_close(all[i].interval.low, number(expected["intervals"][i][0]));
        expect_close(all[i].interval.high, number(expected["intervals"][i][1]));
      }
      expect_close(bands.area.estimate, bands.gap.estimate);  // of the same values here
      expect_close(bands.area.interval.high, bands.gap.interval.high);
    }
    expect_close(found.pairs.front().share.estimate, number(one["improvement"]));
    if (!one.contains("improvement_interval")) continue;
    expect_close(found.pairs.front().share.interval.low, number(one["improvement_interval"][0]));
    expect_close(found.pairs.front().share.interval.high, number(one["improvement_interval"][1]));
  }
}

TEST(Aggregate, WeighsStrataEqually) {
  const StratifiedResampling resampling({2, 6}, 100, 1);
  const AggregateBands bands =
      aggregated(resampling, {errors({{0.2, 0.2}, {0.8, 0.8, 0.8, 0.8, 0.8, 0.8}})}).methods.front();
  EXPECT_DOUBLE_EQ(bands.gap.estimate, 0.5);
  EXPECT_DOUBLE_EQ(bands.iqm.estimate, 0.5);
  EXPECT_DOUBLE_EQ(bands.median.estimate, 0.5) << "half of the weight is on either side";
  EXPECT_DOUBLE_EQ(bands.profile[20].estimate, 0.5);
  EXPECT_DOUBLE_EQ(bands.gap.interval.low, 0.5) << "resamples keep the weights of the strata";
  EXPECT_DOUBLE_EQ(bands.gap.interval.high, 0.5);
  EXPECT_EQ(bands.gap.n, 8u);
}

// Effects of an instance number common to all strata do not average out: bands do not shrink with more levels.
TEST(Aggregate, SharesDrawsAcrossEqualStrata) {
  std::vector<double> column;
  for (int i = 0; i < 20; ++i) column.push_back(i / 20.0);
  const Band one = aggregated(StratifiedResampling({20}, 500, 3), {errors({column})}).methods.front().gap;
  const Band four =
      aggregated(StratifiedResampling({20, 20, 20, 20}, 500, 3), {errors({column, column, column, column})})
          .methods.front()
          .gap;
  expect_close(four.interval.low, one.interval.low);
  expect_close(four.interval.high, one.interval.high);
}

TEST(Aggregate, WidensBandsForTrainings) {
  std::vector<double> one, all;
  for (int training = 0; training < 5; ++training)
    for (int i = 0; i < 40; ++i) all.push_back(0.15 * training + 0.005 * i);
  one.assign(all.begin() + 80, all.begin() + 120);
  const StratifiedResampling resampling({40}, 500, 3);
  const Aggregates found = aggregated(resampling, {errors({all}, 5), errors({one})});
  const auto width = [](const Band& band) { return band.interval.high - band.interval.low; };
  expect_close(found.methods[0].gap.estimate, found.methods[1].gap.estimate);
  EXPECT_GT(width(found.methods[0].gap), 4 * width(found.methods[1].gap));
  EXPECT_GT(width(found.pairs.front().share), 0.3);
}

TEST(Aggregate, KeepsStratumWeightsWithMissingValues) {
  const StratifiedResampling resampling({3, 2}, 50, 1);
  const AggregateBands bands = aggregated(resampling, {errors({{0.1, kMissing, 0.3}, {0.6, 0.6}})}).methods.front();
  EXPECT_DOUBLE_EQ(bands.gap.estimate, 0.4);
  EXPECT_EQ(bands.gap.n, 4u);
  const AggregateBands none =
      aggregated(resampling, {errors({{kMissing, kMissing, kMissing}, {kMissing, kMissing}})}).methods.front();
  EXPECT_EQ(none.iqm.n, 0u);
  EXPECT_TRUE(std::isnan(none.iqm.estimate));
  EXPECT_FALSE(none.iqm.interval.exists());
}

TEST(Aggregate, HasNoBandForOneInstanceOrNoResamples) {
  const Band one = aggregated(StratifiedResampling({1}, 50, 1), {errors({{0.4}})}).methods.front().iqm;
  EXPECT_EQ(one.estimate, 0.4);
  EXPECT_FALSE(one.interval.exists());
  const Aggregates none =
      aggregated(StratifiedResampling({3}, 0, 1), {errors({{0.1, 0.2, 0.3}}), errors({{0.2, 0.2, 0.2}})});
  EXPECT_DOUBLE_EQ(none.methods.front().gap.estimate, 0.2);
  EXPECT_FALSE(none.methods.front().gap.interval.exists());
  EXPECT_DOUBLE_EQ(none.pairs.front().share.estimate, 0.5);
  EXPECT_FALSE(none.pairs.front().share.interval.exists());
}

TEST(Aggregate, IsIndependentOfThreads) {
  std::vector<double> column;
  for (int i = 0; i < 30; ++i) column.push_back(std::fmod(0.37 * i, 1));
  const StratifiedResampling resampling({15, 10}, 300, 9);
  const std::vector<MethodErrors> methods = {
      errors({{column.begin(), column.begin() + 15}, {column.begin() + 15, column.begin() + 25}})};
  Parallel one(1), four(4);
  const AggregateBands a = aggregate(resampling, methods, {}, one).methods.front();
  const AggregateBands b = aggregate(resampling, methods, {}, four).methods.front();
  EXPECT_EQ(a.iqm.interval.low, b.iqm.interval.low);
  EXPECT_EQ(a.profile[13].interval.high, b.profile[13].interval.high);
}

TEST(Aggregate, RejectsValuesOfAnotherShape) {
  const StratifiedResampling resampling({3}, 10, 1);
  EXPECT_THAT(error_text(ErrorKind::internal,
                         [&] {
                           aggregated(resampling, {errors({{0.1, 0.2}})});
                         }),
              HasSubstr("stratum 0 has 2 values for 1 trainings on 3 instances"));
  EXPECT_THAT(error_text(ErrorKind::internal, [&] { aggregated(resampling, {errors({})}); }),
              HasSubstr("0 strata of values for 1 strata"));
}

}  // namespace
}  // namespace relign::statistics
