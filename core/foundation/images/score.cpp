#include "images/score.h"

#include <cmath>

namespace relign::images {

double rmse(const float* a, const float* b, std::size_t count) {
  // Four partial sums in a fixed order: the same result on every machine, and vectorisable.
  double sums[4] = {0, 0, 0, 0};
  for (std::size_t i = 0; i < count; ++i) {
    const double difference = static_cast<double>(a[i]) - static_cast<double>(b[i]);
    sums[i % 4] += difference * difference;
  }
  return std::sqrt(((sums[0] + sums[1]) + (sums[2] + sums[3])) / static_cast<double>(count));
}

}  // namespace relign::images
