// An estimate with its confidence interval, the result type of all statistics in this module.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>

namespace relign::statistics {

inline constexpr double kConfidence = 0.95;
inline constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();  // not computable

// Closed interval. NaN: no interval; either end may be infinite.
struct Interval {
  double low = kMissing, high = kMissing;
  bool exists() const { return !std::isnan(low) && !std::isnan(high); }
};

struct Band {
  std::size_t n = 0;  // values used
  double estimate = kMissing;
  Interval interval;
};

}  // namespace relign::statistics
