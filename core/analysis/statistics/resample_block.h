// A block of resamples side by side, so that one pass over sorted values gives a quantile of all of them: the inner
// loops over resamples are short and free of branches, so that compilers vectorise them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "statistics/resampling.h"

namespace relign::statistics {

class ResampleBlock {
 public:
  static constexpr std::size_t kLanes = 32;

  explicit ResampleBlock(const Resampling& resampling) : resampling_(resampling) {}

  // Resamples first, first + 1, ..., at most kLanes; lanes beyond the last resample have all counts 0.
  void load(std::size_t first);

  std::size_t instances() const { return resampling_.instances(); }
  std::size_t lanes() const { return rows_.size(); }
  // Counts of this instance in each lane, kLanes numbers.
  const std::uint8_t* counts_of(std::uint32_t instance) const { return &by_instance_[instance * kLanes]; }
  // Counts of one lane, one per instance, as Resampling::counts.
  const std::uint8_t* counts(std::size_t lane) const { return rows_[lane]; }

 private:
  const Resampling& resampling_;
  std::vector<std::vector<std::uint8_t>> scratch_;  // if the draws are not stored
  std::vector<const std::uint8_t*> rows_;
  std::vector<std::uint8_t> by_instance_;  // [instance][lane]
};

}  // namespace relign::statistics
