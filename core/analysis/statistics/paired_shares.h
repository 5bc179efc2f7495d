// Two algorithms on the same instances, each of which passes or does not: whose yield is higher, and how surely?
#pragma once

#include <cstddef>
#include <vector>

#include "statistics/band.h"

namespace relign::statistics {

struct PairedShares {
  std::size_t n = 0;
  std::size_t first = 0, second = 0;              // that pass
  std::size_t first_alone = 0, second_alone = 0;  // with the one and not with the other
  // McNemar's test (Psychometrika 12 (1947)) in its exact form: the instances on which the two agree tell nothing, and
  // the others are a fair coin's if the two are equal. Two-sided; 1 where they agree everywhere, missing without any.
  double p = kMissing;
};

// One value an instance. Throws Error (internal) for columns of different lengths.
PairedShares compare_shares(const std::vector<bool>& first, const std::vector<bool>& second);

}  // namespace relign::statistics
