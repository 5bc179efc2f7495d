// An estimate with its interval: what every statistic of the room comes out as.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>

namespace relign::statistics {

inline constexpr double kConfidence = 0.95;
inline constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();  // nobody can know it from these values

// Both ends belong to it. NaN: there is none; an end may be infinite.
struct Interval {
  double low = kMissing, high = kMissing;
  bool exists() const { return !std::isnan(low) && !std::isnan(high); }
};

struct Band {
  std::size_t n = 0;  // values that entered
  double estimate = kMissing;
  Interval interval;
};

}  // namespace relign::statistics
