// Values of methods on several strata (a scene at a noise level), and the stratified bootstrap.
//
// Instances are drawn with replacement within each stratum, which keeps the strata's weights (as rliable, Agarwal et
// al., NeurIPS 2021). Strata with the same number of instances share their draws: an instance number denotes the same
// draw of noise at every level of a scene (base/seeds.h), so that strata are dependent and intervals that assumed
// independence would be too narrow. Trainings of a method are drawn independently of the instances, once for all strata
// (pigeonhole bootstrap, Owen, Annals of Applied Statistics 1 (2007)): the count of a cell is the product of both,
// which makes intervals slightly conservative.
#pragma once

#include <cstdint>
#include <vector>

#include "statistics/resampling.h"

namespace relign::statistics {

// strata[s][training * instances of s + instance]; NaN: no value. trainings is 1 for a method without several.
struct StratifiedValues {
  std::size_t trainings = 1;
  std::vector<std::vector<double>> strata;
};

class StratifiedResampling {
 public:
  // instances[s]: size of stratum s. 0 resamples: estimates without intervals.
  StratifiedResampling(std::vector<std::size_t> instances, std::size_t resamples, std::uint64_t seed);

  const std::vector<std::size_t>& instances() const { return instances_; }
  std::size_t resamples() const { return resamples_; }
  std::uint64_t seed() const { return seed_; }

  // Counts of each instance in one resample, per stratum. A buffer that is reused across resamples.
  struct Draw {
    std::vector<std::vector<std::uint8_t>> of_size;  // one for each distinct number of instances
    std::vector<const std::uint8_t*> strata;
  };
  void draw(std::size_t resample, Draw& draw) const;

 private:
  std::vector<std::size_t> instances_, size_of_;  // size_of_: index into sizes_ of each stratum
  std::vector<Resampling> sizes_;
  std::size_t resamples_;
  std::uint64_t seed_;
};

}  // namespace relign::statistics
