// Values of methods on several strata (a scene at a noise level), and resamples that keep to them.
//
// Instances are drawn with replacement within each stratum, so that each keeps its weight (stratified bootstrap, as
// rliable's, Agarwal et al., NeurIPS 2021). Strata with equally many instances share their draws: an instance number is
// one draw of the noise at every level of a scene (base/seeds.h), so that strata are not independent of each other, and
// bands that took them so would be too narrow. Trainings of one method are drawn as well, independently of the
// instances and once for all strata (pigeonhole bootstrap, Owen, Annals of Applied Statistics 1 (2007)): a cell counts
// as often as the product, somewhat too wide rather than too narrow.
#pragma once

#include <cstdint>
#include <vector>

#include "statistics/resampling.h"

namespace relign::statistics {

// strata[s][training * instances of s + instance]; NaN: no value. A method that is not a list of trainings has 1.
struct StratifiedValues {
  std::size_t trainings = 1;
  std::vector<std::vector<double>> strata;
};

class StratifiedResampling {
 public:
  // instances[s]: how many stratum s has. No resamples: estimates alone.
  StratifiedResampling(std::vector<std::size_t> instances, std::size_t resamples, std::uint64_t seed);

  const std::vector<std::size_t>& instances() const { return instances_; }
  std::size_t resamples() const { return resamples_; }
  std::uint64_t seed() const { return seed_; }

  // How often each instance of each stratum is in one resample, stratum after stratum. Reused from resample to
  // resample.
  struct Draw {
    std::vector<std::vector<std::uint8_t>> of_size;  // one for each number of instances
    std::vector<const std::uint8_t*> strata;
  };
  void draw(std::size_t resample, Draw& draw) const;

 private:
  std::vector<std::size_t> instances_, size_of_;  // size_of_: of each stratum its place in sizes_
  std::vector<Resampling> sizes_;
  std::size_t resamples_;
  std::uint64_t seed_;
};

}  // namespace relign::statistics
