// All values of one method over all strata and trainings, sorted once, so that the aggregates of a resample take one
// pass. Strata have equal weight, shared equally by their values.
#pragma once

#include <cstdint>
#include <vector>

#include "statistics/stratified.h"

namespace relign::statistics {

struct PooledStatistics {
  double iqm = 0, median = 0;
  std::vector<double> profile;  // share of the weight at or below each place of the profile
};

// The mean of the strata's means.
class StratifiedMean {
 public:
  // Throws Error (internal) for a stratum whose size is not instances * trainings.
  StratifiedMean(const StratifiedValues& values, const std::vector<std::size_t>& instances);

  std::size_t size() const { return size_; }  // values that are not NaN
  // Values per training in the smallest stratum: the n of the expanded percentile interval.
  std::size_t fewest_instances() const { return fewest_; }

  // `trainings`: how often each training was drawn. Strata without a drawn value are skipped; NaN if all are.
  double resampled(const StratifiedResampling::Draw& draw, const std::uint8_t* trainings) const;
  // How many values of each stratum the resample has.
  void drawn(const StratifiedResampling::Draw& draw, const std::uint8_t* trainings,
             std::vector<std::size_t>& result) const;

 private:
  std::vector<std::size_t> instances_, first_cell_;
  std::size_t trainings_, size_ = 0, fewest_ = 0;
  std::vector<double> values_;       // [stratum][training][instance]; 0 if missing
  std::vector<std::uint8_t> known_;  // 1 unless missing
  std::vector<bool> complete_;       // no value of the stratum is missing
};

class PooledSample {
 public:
  // `places`: where the performance profile is evaluated, ascending; empty for no profile. Throws as StratifiedMean.
  PooledSample(const StratifiedValues& values, const std::vector<std::size_t>& instances,
               const std::vector<double>& places);

  const StratifiedMean& mean() const { return mean_; }

  // Buffers of resampled(), one per thread.
  struct Scratch {
    std::vector<std::uint16_t> counts;
    std::vector<std::size_t> drawn;
    std::vector<double> unit, weights, sums;
  };
  // As StratifiedMean::resampled.
  void resampled(const StratifiedResampling::Draw& draw, const std::uint8_t* trainings, Scratch& scratch,
                 PooledStatistics& result) const;

 private:
  template <class Unit>
  void walk(const Unit& unit, Scratch& scratch, PooledStatistics& result) const;

  StratifiedMean mean_;
  std::vector<std::size_t> instances_;
  std::size_t trainings_;
  std::vector<double> values_;        // sorted
  std::vector<std::uint32_t> cells_;  // of each value: its index in [stratum][training][instance]
  std::vector<std::uint16_t> stratum_;
  std::vector<std::size_t> below_;  // values at or below each place of the profile
};

// The identity resample, for estimates: each instance and each training once.
class EveryOnce {
 public:
  EveryOnce(const std::vector<std::size_t>& instances, std::size_t trainings);
  StratifiedResampling::Draw draw;
  const std::uint8_t* trainings() const { return ones_.data(); }

 private:
  std::vector<std::uint8_t> ones_;
};

}  // namespace relign::statistics
