#include "imaging/sequences.h"

namespace relign::imaging {

int binomial_thresholds(int n, double p, std::uint32_t* thresholds) {
  // By the recurrence of its terms.
  double term = 1;  // (1 - p)^n by squaring
  double base = 1 - p;
  for (int left = n; left > 0; left >>= 1) {
    if (left & 1) term *= base;
    base *= base;
  }
  double sum = 0;
  int levels = 0;
  for (int k = 0; k < n; ++k) {
    sum += term;
    const double scaled = sum * 4294967296.0;
    if (scaled >= 4294967295.0) break;
    thresholds[levels++] = static_cast<std::uint32_t>(scaled);
    term *= (n - k) * p / ((k + 1) * (1 - p));
  }
  return levels;
}

}  // namespace relign::imaging
