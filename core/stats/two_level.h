// Bands for algorithms that were trained, or draw random numbers: other instances could have come, and another
// training, too.
//
// Every training seed met every instance, so both are drawn with replacement, independently of each other, and a cell
// counts as often as the product (pigeonhole bootstrap, Owen, Annals of Applied Statistics 1 (2007)): somewhat too wide
// rather than too narrow. Instances come from the same draws as those of Resampling under the same seed: an algorithm
// without training stays paired with one that has it.
#pragma once

#include <cstdint>
#include <vector>

#include "stats/bootstrap.h"

namespace relign::stats {

class TwoLevelResampling {
 public:
  // Throws Error as Resampling does.
  TwoLevelResampling(std::size_t training_seeds, std::size_t instances, std::size_t resamples, std::uint64_t seed)
      : training_seeds_(training_seeds, resamples, seed, 1), instances_(instances, resamples, seed) {}

  const Resampling& training_seeds() const { return training_seeds_; }
  const Resampling& instances() const { return instances_; }

 private:
  Resampling training_seeds_, instances_;
};

// columns: one an algorithm, [training seed][instance] one after the other, NaN where there is no value. Errors as
// resampled() of one level.
std::vector<Replicates> resampled(const TwoLevelResampling& resampling, const std::vector<std::vector<double>>& columns,
                                  const OrderStatistic& statistic);

// Intervals are expanded for the number of training seeds or instances, whichever is smaller. One training seed has no
// interval: it says nothing about the next training. Ask for 5 at least; few of them make wide bands, as they must.
std::vector<Band> bands(const TwoLevelResampling& resampling, const std::vector<std::vector<double>>& columns,
                        const OrderStatistic& statistic, double confidence = kConfidence);

}  // namespace relign::stats
