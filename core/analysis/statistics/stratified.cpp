#include "statistics/stratified.h"

#include <map>

namespace relign::statistics {

StratifiedResampling::StratifiedResampling(std::vector<std::size_t> instances, std::size_t resamples,
                                           std::uint64_t seed)
    : instances_(std::move(instances)), resamples_(resamples), seed_(seed) {
  if (resamples == 0) return;
  std::map<std::size_t, std::size_t> place;
  for (const std::size_t count : instances_) {
    const auto [found, is_new] = place.try_emplace(count, sizes_.size());
    if (is_new) sizes_.emplace_back(count, resamples, seed);
    size_of_.push_back(found->second);
  }
}

void StratifiedResampling::draw(std::size_t resample, Draw& draw) const {
  draw.of_size.resize(sizes_.size());
  std::vector<const std::uint8_t*> counts;
  for (std::size_t size = 0; size < sizes_.size(); ++size)
    counts.push_back(sizes_[size].counts(resample, draw.of_size[size]));
  draw.strata.clear();
  for (const std::size_t size : size_of_) draw.strata.push_back(counts[size]);
}

}  // namespace relign::statistics
