// Some resamples side by side, so that one walk over sorted values finds a quantile of all of them at once: the loops
// over resamples are short and without branches, which compilers turn into vector instructions.
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

  // Resamples first, first + 1, ..., kLanes at most; lanes beyond the last resample draw nothing.
  void load(std::size_t first);

  std::size_t instances() const { return resampling_.instances(); }
  std::size_t lanes() const { return rows_.size(); }
  // How often the lanes' resamples drew this instance, kLanes numbers.
  const std::uint8_t* counts_of(std::uint32_t instance) const { return &by_instance_[instance * kLanes]; }
  // One lane's counts, one an instance, as Resampling::counts.
  const std::uint8_t* counts(std::size_t lane) const { return rows_[lane]; }

 private:
  const Resampling& resampling_;
  std::vector<std::vector<std::uint8_t>> scratch_;  // where draws are not kept
  std::vector<const std::uint8_t*> rows_;
  std::vector<std::uint8_t> by_instance_;  // [instance][lane]
};

}  // namespace relign::statistics
