// Proportions with Wilson score intervals, such as the yield.
#pragma once

#include <cstddef>

#include "statistics/band.h"

namespace relign::statistics {

// The proportion with its Wilson score interval (E. B. Wilson, JASA 22 (1927), recommended by Brown, Cai and DasGupta,
// Statistical Science 16 (2001)) without continuity correction. The interval is within [0, 1] and has a positive
// width at 0 and n successes as well: 95 of 100 gives 0.888 to 0.978, 10 of 10 gives 0.722 to 1. All NaN without
// trials. Throws Error: internal for more successes than trials, bad_input for a confidence outside (0, 1).
Band success_rate(std::size_t successes, std::size_t trials, double confidence = kConfidence);

// The same for the mean of scores in [0, 1], such as 1/2 for a tie: slightly too wide if many are fractional. `total`:
// sum of the scores.
Band share_of_scores(double total, std::size_t trials, double confidence = kConfidence);

}  // namespace relign::statistics
