// Weighted means of sorted values: mean, quantile, interquartile mean.
//
// All of them are sums of weights times order statistics (L-statistics). So one walk over values that were sorted once,
// with how often each was drawn, gives any of them for a resample: nothing is sorted 10,000 times.
#pragma once

#include <cstddef>
#include <vector>

namespace relign::statistics {

class OrderStatistic {
 public:
  static OrderStatistic mean() { return {Kind::mean, 0}; }
  static OrderStatistic median() { return {Kind::quantile, 0.5}; }
  // Linear interpolation between order statistics (type 7 of Hyndman and Fan 1996, NumPy's default). Throws Error
  // (bad_input) for a share outside 0 to 1.
  static OrderStatistic quantile(double share);
  // Interquartile mean: the mean of the middle half. The outer quarters are cut to fractions of a value: 10 values lose
  // 2.5 at either end, that is two whole ones and half of the next. For a number of values that 4 divides this is
  // scipy.stats.trim_mean(values, 0.25), which rliable uses (Agarwal et al. 2021); that one cuts whole values only.
  static OrderStatistic iqm() { return {Kind::iqm, 0}; }

  bool is_quantile() const { return kind_ == Kind::quantile; }
  double share() const { return share_; }  // of a quantile

  // The weight of the first `count` of `n` sorted values together: 0 for none, 1 for all.
  double weight_below(std::size_t count, std::size_t n) const;

  // NaN does not enter; without any value NaN. Infinities count where they have weight: both kinds at once give NaN.
  // The result has the unit of the values and does not depend on their order.
  double of(std::vector<double> values) const;

 private:
  enum class Kind { mean, quantile, iqm };
  OrderStatistic(Kind kind, double share) : kind_(kind), share_(share) {}

  Kind kind_;
  double share_;
};

}  // namespace relign::statistics
