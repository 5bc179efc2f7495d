// L-statistics: mean, quantile and interquartile mean as weighted sums of order statistics.
//
// Values are sorted once; with the count of each value in a resample, one pass over them gives the statistic of that
// resample, so that 10,000 resamples need no further sorting.
#pragma once

#include <array>
#include <cstddef>
#include <type_traits>
#include <vector>

namespace relign::statistics {

class OrderStatistic {
 public:
  static OrderStatistic mean() { return {Kind::mean, 0}; }
  static OrderStatistic median() { return {Kind::quantile, 0.5}; }
  // Linear interpolation between order statistics (type 7 of Hyndman and Fan 1996, NumPy's default). Throws Error
  // (bad_input) for a share outside [0, 1].
  static OrderStatistic quantile(double share);
  // Interquartile mean: the mean of the middle half, cutting fractions of values: of 10 values 2.5 at either end. If 4
  // divides the number of values this equals scipy.stats.trim_mean(values, 0.25), which rliable uses (Agarwal et al.
  // 2021) and which cuts whole values only.
  static OrderStatistic iqm() { return {Kind::trimmed, 0.25}; }

  bool is_quantile() const { return kind_ == Kind::quantile; }
  double share() const { return share_; }  // of a quantile, or cut at either end

  // Cumulative weight of the first `count` of `n` sorted values: 0 for none, 1 for all.
  double weight_below(std::size_t count, std::size_t n) const;

  // In the unit of the values, independent of their order. NaN values are skipped; NaN without any value. Infinite
  // values count where they have weight; infinities of both signs give NaN.
  double of(std::vector<double> values) const;

 private:
  enum class Kind { mean, quantile, trimmed };
  OrderStatistic(Kind kind, double share) : kind_(kind), share_(share) {}

  Kind kind_;
  double share_;
};

// A statistic of the errors after the last step at the pose that counts as recommended, with a 95 % interval. Study,
// JSON, CSV and ranking follow this table.
struct FinalStatistic {
  const char* key;                  // in files: recommended.KEY of report --format json, recommended_KEY in CSV
  const char *title, *unit, *hint;  // of the ranking's column; the unit without "(95 %)"
  OrderStatistic (*of)();
  bool in_ranking;
};
inline constexpr std::array kFinalStatistics = {
    FinalStatistic{"iqm", "IQM", "of the final error",
                   "Interquartile mean: the mean of the middle half of the instances", &OrderStatistic::iqm, false}};
using FinalStatistics = std::remove_const_t<decltype(kFinalStatistics)>;

}  // namespace relign::statistics
