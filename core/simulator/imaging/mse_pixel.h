// One pixel's part of a noise-free MSE, for CPU and GPU kernels. No library functions: NVRTC compiles this header.
#pragma once

#include <relign/philox.hpp>

namespace relign::imaging {

constexpr int kMseGroups = 4;  // independent renders

struct MseSum {
  double product = 0, variance = 0;
  RELIGN_DEVICE MseSum& operator+=(const MseSum& other) {
    product += other.product;
    variance += other.variance;
    return *this;
  }
};

// Mean over pairs of different groups of (A_i - O1)(A_j - O2).
RELIGN_DEVICE double product_of_pixel(const double (&values)[kMseGroups], double o1, double o2) {
  constexpr int groups = kMseGroups;
  double total = 0, crossed = 0;
  for (const double a : values) {
    total += a;
    crossed += (a - o1) * (a - o2);
  }
  return ((total - groups * o1) * (total - groups * o2) - crossed) / (groups * (groups - 1));
}

// values: one of each group. o1, o2: two independent references.
RELIGN_DEVICE MseSum mse_of_pixel(const double (&values)[kMseGroups], double o1, double o2) {
  constexpr int groups = kMseGroups;
  MseSum sum;
  sum.product = product_of_pixel(values, o1, o2);
  // Its variance is (d1 + d2)^2 s2 / g + 2 s2^2 / (g (g - 1)) for g groups of variance s2 and differences d1, d2 from
  // the two references. Both terms are products of estimates from two disjoint pairs of groups, hence unbiased however
  // the values scatter: with ghosts they are rare and bright, far from normal.
  static_assert(kMseGroups == 4, "pairs of groups are paired off below");
  constexpr int pairings[3][4] = {{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2}};
  double linear = 0, square = 0;
  for (const auto& [i, j, k, l] : pairings) {
    const auto both = [&](int m, int n) { return (2 * values[m] - o1 - o2) * (2 * values[n] - o1 - o2); };
    const auto scatter = [&](int m, int n) { return 0.5 * (values[m] - values[n]) * (values[m] - values[n]); };
    const double one = scatter(i, j), other = scatter(k, l);
    linear += (both(i, j) * other + both(k, l) * one) / 6;
    square += one * other / 3;
  }
  sum.variance = linear / groups + 2 * square / (groups * (groups - 1));
  return sum;
}

}  // namespace relign::imaging
