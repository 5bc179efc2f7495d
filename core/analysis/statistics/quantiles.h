// Order statistics of values that may be missing.
#pragma once

#include <cstddef>
#include <vector>

namespace relign::statistics {

struct Quantiles {
  std::size_t n = 0;  // values that entered
  double median = 0, q25 = 0, q75 = 0, mean = 0;
};

// Linear interpolation between order statistics (NumPy's default, type 7). NaN does not enter. No value
// at all: n = 0 and every number NaN.
Quantiles quantiles(std::vector<double> values);

}  // namespace relign::statistics
