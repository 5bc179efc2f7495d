#include "warp.hpp"

#include <cmath>

#include "standard.hpp"

namespace surrogates {
namespace {

// Log likelihood of a normal distribution after the transform, up to a constant.
double normality(const Vector& values, double power) {
  const Vector bent = values.unaryExpr([&](double value) { return yeo_johnson(value, power); });
  const double variance = (bent.array() - bent.mean()).square().mean();
  const double stretch =
      values.unaryExpr([](double value) { return std::copysign(std::log1p(std::fabs(value)), value); }).sum();
  return -0.5 * static_cast<double>(values.size()) * std::log(variance) + (power - 1) * stretch;
}

}  // namespace

double yeo_johnson(double value, double power) {
  // expm1 is exact for exponents near 0.
  const auto side = [](double magnitude, double exponent) {
    const double log = std::log1p(magnitude);
    return std::fabs(exponent) < 1e-9 ? log : std::expm1(exponent * log) / exponent;
  };
  return value >= 0 ? side(value, power) : -side(-value, 2 - power);
}

double best_power(const Vector& standardised) {
  if (standardised.size() < 3 || standardised.maxCoeff() - standardised.minCoeff() < 1e-9) return 1;
  double low = -1;
  double high = 3;
  const double golden = 0.5 * (std::sqrt(5.0) - 1);
  for (int i = 0; i < 24; ++i) {
    const double a = high - golden * (high - low);
    const double b = low + golden * (high - low);
    if (normality(standardised, a) > normality(standardised, b))
      high = b;
    else
      low = a;
  }
  return 0.5 * (low + high);
}

Vector warped(const Vector& values) {
  const Vector standardised = Standard(values).apply(values);
  const double power = best_power(standardised);
  return standardised.unaryExpr([&](double value) { return yeo_johnson(value, power); });
}

}  // namespace surrogates
