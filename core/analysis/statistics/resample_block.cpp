#include "statistics/resample_block.h"

#include <algorithm>

namespace relign::statistics {

void ResampleBlock::load(std::size_t first) {
  const std::size_t instances = resampling_.instances();
  const std::size_t lanes = std::min(kLanes, resampling_.resamples() - first);
  scratch_.resize(kLanes);
  rows_.clear();
  by_instance_.assign(instances * kLanes, 0);
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    rows_.push_back(resampling_.counts(first + lane, scratch_[lane]));
    for (std::size_t instance = 0; instance < instances; ++instance)
      by_instance_[instance * kLanes + lane] = rows_[lane][instance];
  }
}

}  // namespace relign::statistics
