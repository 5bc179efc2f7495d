// Wilcoxon's signed-rank test: do paired differences lie on one side of zero more than chance would have it?
#pragma once

#include <cstddef>
#include <vector>

#include "statistics/band.h"

namespace relign::statistics {

// 1 for the lowest value; equal values share the mean of their ranks. Values are no NaN, but may be infinite.
std::vector<double> midranks(const std::vector<double>& values);

struct SignedRank {
  std::size_t n = 0;            // differences that entered: neither zero nor NaN
  std::size_t zeros = 0;        // left out, as Wilcoxon did (Biometrics Bulletin 1 (1945))
  double above = 0, below = 0;  // sums of the ranks of positive and of negative differences
  double p = 1;                 // two-sided; 1 without any difference
  bool exact = true;
};

// Exact up to kExactSignedRank differences: all 2^n signs of the ranks as they are, ties included. Above, the normal
// approximation with the correction for ties and none for continuity. So scipy.stats.wilcoxon has the same p by its
// defaults, but for 14 to 50 differences with ties or zeros, where it approximates.
// Infinite differences are the largest, and tied. Two-sided p below 0.05 needs at least 6 differences.
inline constexpr std::size_t kExactSignedRank = 50;
SignedRank signed_rank(const std::vector<double>& differences);

}  // namespace relign::statistics
