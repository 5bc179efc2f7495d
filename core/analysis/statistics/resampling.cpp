#include "statistics/resampling.h"

#include <algorithm>
#include <limits>
#include <relign/random.hpp>

#include "base/error.h"

namespace relign::statistics {

Resampling::Resampling(std::size_t instances, std::size_t resamples, std::uint64_t seed, std::uint32_t level)
    : instances_(instances), resamples_(resamples), seed_(seed), level_(level) {
  if (resamples == 0) {
    throw Error(ErrorKind::bad_input, "the bootstrap needs at least 1 resample, usually 10,000, not 0");
  }
  if (instances == 0 || instances > kKeptBytes / resamples) return;
  kept_.resize(instances * resamples);
  for (std::size_t resample = 0; resample < resamples; ++resample) draw(resample, &kept_[resample * instances]);
}

const std::uint8_t* Resampling::counts(std::size_t resample, std::vector<std::uint8_t>& scratch) const {
  if (!kept_.empty()) return &kept_[resample * instances_];
  scratch.resize(instances_);
  draw(resample, scratch.data());
  return scratch.data();
}

void Resampling::draw(std::size_t resample, std::uint8_t* counts) const {
  std::fill(counts, counts + instances_, std::uint8_t{0});
  Random random(seed_, std::uint64_t{level_} << 40 | resample);
  for (std::size_t drawn = 0; drawn < instances_; ++drawn) {
    std::uint8_t& count = counts[random.below(instances_)];
    // Probability below 10^-500.
    if (++count == std::numeric_limits<std::uint8_t>::max()) {
      throw Error(ErrorKind::internal, "an instance was drawn 255 times in one resample; choose another seed");
    }
  }
}

}  // namespace relign::statistics
