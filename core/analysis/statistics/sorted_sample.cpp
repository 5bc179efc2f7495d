#include "statistics/sorted_sample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace relign::statistics {
namespace {

// The end of a pass is checked once per so many values, so that the inner loop has no branch.
constexpr std::size_t kPlacesAtOnce = 64;

}  // namespace

SortedSample::SortedSample(const std::vector<double>& values) {
  for (std::size_t instance = 0; instance < values.size(); ++instance) {
    if (!std::isnan(values[instance])) instances_.push_back(static_cast<std::uint32_t>(instance));
  }
  std::stable_sort(instances_.begin(), instances_.end(),
                   [&](std::uint32_t left, std::uint32_t right) { return values[left] < values[right]; });
  values_.reserve(instances_.size());
  for (const std::uint32_t instance : instances_) values_.push_back(values[instance]);
  if (values_.empty()) return;
  finite_ = std::isfinite(values_.front()) && std::isfinite(values_.back());
  all_equal_ = values_.front() == values_.back();
}

// The quantile of `drawn` values is between the order statistics `below` and `below + 1` (from 0). The index of an
// order statistic among the sorted values is the number of values with a cumulative count of at most `below`.
template <class Count>
void SortedSample::walk(const ResampleBlock& block, double share, double* results) const {
  constexpr std::size_t kLanes = ResampleBlock::kLanes;
  std::array<Count, kLanes> drawn{}, below{}, next{}, taken{}, place{}, next_place{};
  if (values_.size() == block.instances()) {
    drawn.fill(static_cast<Count>(block.instances()));
  } else {
    for (const std::uint32_t instance : instances_) {
      const std::uint8_t* counts = block.counts_of(instance);
      for (std::size_t lane = 0; lane < kLanes; ++lane) drawn[lane] = static_cast<Count>(drawn[lane] + counts[lane]);
    }
  }
  std::array<double, kLanes> fraction{};
  for (std::size_t lane = 0; lane < block.lanes(); ++lane) {
    if (drawn[lane] == 0) continue;
    const double exact = (static_cast<double>(drawn[lane]) - 1) * share;
    below[lane] = static_cast<Count>(exact);
    next[lane] = static_cast<Count>(below[lane] + 1);
    fraction[lane] = exact - static_cast<double>(below[lane]);
  }
  for (std::size_t first = 0; first < instances_.size(); first += kPlacesAtOnce) {
    const std::size_t last = std::min(first + kPlacesAtOnce, instances_.size());
    for (std::size_t at = first; at < last; ++at) {
      const std::uint8_t* counts = block.counts_of(instances_[at]);
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        taken[lane] = static_cast<Count>(taken[lane] + counts[lane]);
        place[lane] = static_cast<Count>(place[lane] + (taken[lane] <= below[lane]));
        next_place[lane] = static_cast<Count>(next_place[lane] + (taken[lane] <= next[lane]));
      }
    }
    bool over = true;
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      over = over && (taken[lane] > next[lane] || taken[lane] >= drawn[lane]);
    if (over) break;
  }
  for (std::size_t lane = 0; lane < block.lanes(); ++lane) {
    if (drawn[lane] == 0) {
      results[lane] = kMissing;
      continue;
    }
    const double lower = values_[place[lane]];
    // With fraction 0 the next value may not exist, or be infinite.
    const double upper = fraction[lane] > 0 ? values_[next_place[lane]] : lower;
    results[lane] = lower == upper ? lower : (1 - fraction[lane]) * lower + fraction[lane] * upper;
  }
}

void SortedSample::quantiles(const ResampleBlock& block, double share, double* results) const {
  if (block.instances() < std::numeric_limits<std::uint16_t>::max())
    walk<std::uint16_t>(block, share, results);
  else
    walk<std::uint32_t>(block, share, results);
}

}  // namespace relign::statistics
