#include "statistics/distributions.h"

#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <string>

#include "base/error.h"

namespace relign::statistics {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

void check_probability(double probability) {
  if (probability >= 0 && probability <= 1) return;
  throw Error(ErrorKind::internal, "probability " + std::to_string(probability) + " is outside 0 to 1");
}

void check_degrees(double degrees) {
  if (degrees > 0) return;
  throw Error(ErrorKind::internal, "degrees of freedom must be positive, not " + std::to_string(degrees));
}

}  // namespace

double normal_lower(double z) {
  if (std::isnan(z)) return z;
  return boost::math::cdf(boost::math::normal(), z);
}

double normal_quantile(double probability) {
  if (std::isnan(probability)) return probability;
  check_probability(probability);
  if (probability == 0) return -kInfinite;
  if (probability == 1) return kInfinite;
  return boost::math::quantile(boost::math::normal(), probability);
}

double student_t_quantile(double probability, double degrees) {
  if (std::isnan(probability)) return probability;
  check_probability(probability);
  check_degrees(degrees);
  if (probability == 0) return -kInfinite;
  if (probability == 1) return kInfinite;
  return boost::math::quantile(boost::math::students_t(degrees), probability);
}

double chi_squared_upper(double value, double degrees) {
  if (std::isnan(value)) return value;
  check_degrees(degrees);
  if (value <= 0) return 1;
  if (std::isinf(value)) return 0;
  return boost::math::cdf(boost::math::complement(boost::math::chi_squared(degrees), value));
}

double fisher_f_upper(double value, double numerator, double denominator) {
  if (std::isnan(value)) return value;
  check_degrees(numerator);
  check_degrees(denominator);
  if (value <= 0) return 1;
  if (std::isinf(value)) return 0;
  return boost::math::cdf(boost::math::complement(boost::math::fisher_f(numerator, denominator), value));
}

double fair_coin_lower(std::size_t heads, std::size_t throws) {
  if (heads >= throws) return 1;
  return boost::math::cdf(boost::math::binomial(static_cast<double>(throws), 0.5), static_cast<double>(heads));
}

void check_confidence(double confidence) {
  if (confidence > 0 && confidence < 1) return;
  throw Error(ErrorKind::bad_input,
              "confidence " + std::to_string(confidence) + " must be between 0 and 1, usually 0.95");
}

}  // namespace relign::statistics
