// Values sorted once, so that the statistic of a resample takes one pass.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "statistics/band.h"
#include "statistics/order_statistic.h"
#include "statistics/resample_block.h"

namespace relign::statistics {

class SortedSample {
 public:
  // One value per instance; NaN values are skipped.
  explicit SortedSample(const std::vector<double>& values);

  std::size_t size() const { return values_.size(); }  // without NaN

  // The statistic of a resample with instance i drawn counts[i] times; NaN if no value was drawn.
  template <class Count>
  double resampled(const Count* counts, const OrderStatistic& statistic) const {
    if (all_equal_) return drawn(counts) == 0 ? kMissing : values_.front();
    const std::size_t n = drawn(counts);
    double sum = 0, before = 0;
    for (std::size_t place = 0, taken = 0; place < values_.size() && before < 1; ++place) {
      taken += counts[instances_[place]];
      const double weight = statistic.weight_below(taken, n);
      if (weight != before) sum += (weight - before) * values_[place];  // never 0 * infinity
      before = weight;
    }
    return n == 0 ? kMissing : sum;
  }

  // A quantile (type 7) of each resample of the block, equal to resampled() with OrderStatistic::quantile(share).
  void quantiles(const ResampleBlock& block, double share, double* results) const;

  // resampled() with a table of weights, OrderStatistic::weight_below(0 ... size(), size()): valid if no value is
  // missing or infinite, so that counts add up to size().
  bool takes_table(std::size_t instances) const { return finite_ && !all_equal_ && values_.size() == instances; }
  template <class Count>
  double resampled(const Count* counts, const std::vector<double>& weights) const {
    double sum = 0, before = 0;
    for (std::size_t place = 0, taken = 0; place < values_.size(); ++place) {
      taken += counts[instances_[place]];
      const double weight = weights[taken];
      sum += (weight - before) * values_[place];
      before = weight;
    }
    return sum;
  }

 private:
  template <class Count>
  std::size_t drawn(const Count* counts) const {
    std::size_t n = 0;
    for (const std::uint32_t instance : instances_) n += counts[instance];
    return n;
  }

  template <class Count>
  void walk(const ResampleBlock& block, double share, double* results) const;

  std::vector<double> values_;
  std::vector<std::uint32_t> instances_;  // of each sorted value
  bool finite_ = true, all_equal_ = false;
};

}  // namespace relign::statistics
