#include "statistics/quantiles.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relign::statistics {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Type 7: interpolated at (n - 1) p of the sorted values.
double quantile(const std::vector<double>& sorted, double share) {
  const double place = static_cast<double>(sorted.size() - 1) * share;
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double fraction = place - static_cast<double>(below);
  if (fraction == 0) return sorted[below];  // infinity - infinity would be NaN
  return sorted[below] + fraction * (sorted[above] - sorted[below]);
}

}  // namespace

Quantiles quantiles(std::vector<double> values) {
  values.erase(std::remove_if(values.begin(), values.end(), [](double value) { return std::isnan(value); }),
               values.end());
  Quantiles result{values.size(), kNone, kNone, kNone, kNone};
  if (values.empty()) return result;
  // Summed in sorted order, so that the mean does not depend on the order of the values.
  std::sort(values.begin(), values.end());
  double sum = 0;
  for (const double value : values) sum += value;
  result.mean = sum / static_cast<double>(values.size());
  result.median = quantile(values, 0.5);
  result.q25 = quantile(values, 0.25);
  result.q75 = quantile(values, 0.75);
  return result;
}

}  // namespace relign::statistics
