// Wilcoxon's signed-rank test for paired differences.
#pragma once

#include <cstddef>
#include <vector>

#include "statistics/band.h"

namespace relign::statistics {

// Ranks from 1 (lowest); ties share the mean of their ranks. Values may be infinite but not NaN.
std::vector<double> midranks(const std::vector<double>& values);

struct SignedRank {
  std::size_t n = 0;            // differences used: neither zero nor NaN
  std::size_t zeros = 0;        // left out, as Wilcoxon did (Biometrics Bulletin 1 (1945))
  double above = 0, below = 0;  // sums of the ranks of positive and of negative differences
  double p = 1;                 // two-sided; 1 without differences
  bool exact = true;
};

// Exact up to kExactSignedRank differences, over all 2^n signs of the actual ranks, ties included; beyond that the
// normal approximation with tie correction and without continuity correction. Agrees with the defaults of
// scipy.stats.wilcoxon except for 14 to 50 differences with ties or zeros, where SciPy approximates. Infinite
// differences rank highest and tie. A two-sided p below 0.05 needs at least 6 differences.
inline constexpr std::size_t kExactSignedRank = 50;
SignedRank signed_rank(const std::vector<double>& differences);

}  // namespace relign::statistics
