// Paired comparison of two yields: pass or fail on the same instances.
#pragma once

#include <cstddef>
#include <vector>

#include "statistics/band.h"

namespace relign::statistics {

struct PairedShares {
  std::size_t n = 0;
  std::size_t first = 0, second = 0;              // passes
  std::size_t first_alone = 0, second_alone = 0;  // passes with this one only
  // McNemar's exact test (Psychometrika 12 (1947)), two-sided: among the instances with different outcomes, either
  // algorithm passes with probability 1/2 if the two are equal. 1 if all outcomes agree, NaN without instances.
  double p = kMissing;
};

// One value per instance. Throws Error (internal) for columns of different lengths.
PairedShares compare_shares(const std::vector<bool>& first, const std::vector<bool>& second);

}  // namespace relign::statistics
