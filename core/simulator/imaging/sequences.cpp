#include "imaging/sequences.h"

#include <cstddef>

namespace relign::imaging {

std::vector<int> allocate_samples(int total, const std::vector<double>& weights) {
  // One sample at a time to the largest deficit: no count exceeds its share rounded up.
  std::vector<int> counts(weights.size(), 1);
  for (int given = static_cast<int>(weights.size()); given < total; ++given) {
    std::size_t next = 0;
    double largest = -1e300;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const double deficit = total * weights[i] - counts[i];
      if (deficit <= largest) continue;
      largest = deficit;
      next = i;
    }
    ++counts[next];
  }
  return counts;
}

}  // namespace relign::imaging
