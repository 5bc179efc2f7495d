#include "drawing/scales.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace relign::drawing {
namespace {

constexpr double kRounding = 1e-9;  // of a step: rounding of sums of steps

}  // namespace

double round_step(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value) + kRounding));
  for (const double factor : {5.0, 2.0})
    if (factor * power <= value * (1 + kRounding)) return factor * power;
  return power;
}

std::vector<double> ticks(double low, double high, int count) {
  if (!(high > low)) return {low};
  // The next larger round step, so that no axis gets many more ticks than requested.
  const double even = (high - low) / count;
  double step = round_step(even);
  if (step < even * (1 - kRounding)) step = round_step(2.5 * even);
  std::vector<double> all;
  for (double k = std::ceil(low / step - kRounding); k * step <= high + kRounding * step; ++k) all.push_back(k * step);
  return all;
}

std::string tick_text(double value, double step) {
  const int decimals = std::clamp(static_cast<int>(-std::floor(std::log10(step) + kRounding)), 0, 12);
  if (std::fabs(value) < step * kRounding) value = 0;  // no "-0"
  char buffer[64];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed, decimals);
  return result.ec == std::errc() ? std::string(buffer, result.ptr) : "";
}

}  // namespace relign::drawing
