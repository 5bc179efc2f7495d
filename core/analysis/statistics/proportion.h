// Shares of successes: how many of the trials came within the specification.
#pragma once

#include <cstddef>

#include "statistics/band.h"

namespace relign::statistics {

// The share (0 to 1) with its Wilson score interval (E. B. Wilson, JASA 22 (1927); Brown, Cai and DasGupta, Statistical
// Science 16 (2001), which recommends it) without continuity correction. It stays inside 0 to 1 and has a width at 0
// and n successes, too: 95 of 100 is 0.888 to 0.978, 10 of 10 is 0.722 to 1. Without trials everything is missing.
// Throws Error (internal) for more successes than trials, (bad_input) for a confidence not between 0 and 1.
Band success_rate(std::size_t successes, std::size_t trials, double confidence = kConfidence);

// The same for a mean of scores that lie between 0 and 1, such as 1/2 for a draw: somewhat too wide where many do.
// `total`: sum of the scores.
Band share_of_scores(double total, std::size_t trials, double confidence = kConfidence);

}  // namespace relign::statistics
