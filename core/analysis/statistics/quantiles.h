// Median, quartiles and mean of values that may be missing.
#pragma once

#include <cstddef>
#include <vector>

namespace relign::statistics {

struct Quantiles {
  std::size_t n = 0;  // values used
  double median = 0, q25 = 0, q75 = 0, mean = 0;
};

// Linear interpolation between order statistics (type 7, NumPy's default). NaN values are skipped; without any value n
// is 0 and all numbers are NaN.
Quantiles quantiles(std::vector<double> values);

}  // namespace relign::statistics
