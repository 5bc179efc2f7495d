#include "imaging/binomial.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace relign::imaging {
namespace {

// Mean and variance of the numbers drawn by thresholds, also where (1 - p)^n is far below the range of double.
TEST(BinomialThresholds, HaveTheMomentsOfTheDistribution) {
  for (const int n : {1, 64, 1024, 4096})
    for (const double p : {0.001, 0.04, 0.3, 0.7, 0.97}) {
      std::vector<std::uint32_t> thresholds(static_cast<std::size_t>(n));
      const int levels = binomial_thresholds(n, p, thresholds.data());
      ASSERT_LE(levels, n);
      // E[K] = sum of P(K > k), E[K^2] = sum of (2 k + 1) P(K > k).
      double mean = 0, squares = 0;
      for (int k = 0; k < levels; ++k) {
        const double above = 1 - std::ldexp(thresholds[static_cast<std::size_t>(k)], -32);
        mean += above;
        squares += (2 * k + 1) * above;
      }
      EXPECT_NEAR(mean, n * p, 1e-6 * n) << n << " " << p;
      EXPECT_NEAR(squares - mean * mean, n * p * (1 - p), 1e-5 * n * n) << n << " " << p;
    }
}

}  // namespace
}  // namespace relign::imaging
