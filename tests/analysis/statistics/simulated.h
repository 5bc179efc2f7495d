// Synthetic results with known true values, for simulations of coverage and of A/A comparisons.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <relign/random.hpp>
#include <string>
#include <vector>

#include "statistics/distributions.h"

namespace relign::test {

struct Distribution {
  std::string name;
  std::function<double(Random&)> draw;
  double median, iqm;  // true values
};

inline constexpr double kFloor = -0.25;  // 40 % of normal values are below

inline double normal_density(double z) { return std::exp(-z * z / 2) / std::sqrt(2 * 3.14159265358979323846); }

inline std::vector<Distribution> distributions() {
  using statistics::normal_lower;
  const double quarter = statistics::normal_quantile(0.75);
  const double lognormal_iqm = 2 * std::exp(0.5) * (normal_lower(quarter - 1) - normal_lower(-quarter - 1));
  const double floor_iqm =
      2 * (kFloor * (normal_lower(kFloor) - 0.25) + normal_density(kFloor) - normal_density(quarter));
  return {{"normal", [](Random& random) { return random.normal(); }, 0, 0},
          {"lognormal", [](Random& random) { return std::exp(random.normal()); }, 1, lognormal_iqm},
          {"40 % at a floor", [](Random& random) { return std::max(kFloor, random.normal()); }, 0, floor_iqm},
          {"grid of 0.5 sigma", [](Random& random) { return std::round(2 * random.normal()) / 2; }, 0, 0}};
}

// RMSE of an algorithm on an instance of difficulty `hard`: two calls simulate two names of one algorithm.
struct Algorithm {
  std::string name;
  std::function<double(double hard, Random&)> run;
};

inline std::vector<Algorithm> algorithms() {
  return {
      {"lognormal", [](double hard, Random& random) { return hard * std::exp(0.3 * random.normal()); }},
      {"1 of 10 fails",
       [](double hard, Random& random) {
         return hard * std::exp((random.uniform() < 0.1 ? 2 : 0.3) * random.normal());
       }},
      {"half at a floor", [](double hard, Random& random) { return hard * std::exp(std::max(0.0, random.normal())); }}};
}

}  // namespace relign::test
