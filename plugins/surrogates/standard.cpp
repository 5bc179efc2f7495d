#include "standard.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace surrogates {
namespace {

constexpr double kHuge = 1e100;

}  // namespace

Standard::Standard(const Vector& values) : mean(values.mean()) {
  const double deviation = std::sqrt((values.array() - mean).square().mean());
  // Otherwise the values are equal up to rounding.
  if (deviation > 10 * std::numeric_limits<double>::epsilon() * std::fabs(mean)) scale = deviation;
}

bool is_usable(double merit) { return std::fabs(merit) < kHuge; }  // false for NaN

Vector usable_merits(const std::vector<double>& merits) {
  double worst = -kHuge;
  for (const double merit : merits)
    if (is_usable(merit)) worst = std::max(worst, merit);
  if (worst == -kHuge) worst = 0;
  Vector made(static_cast<Eigen::Index>(merits.size()));
  for (std::size_t i = 0; i < merits.size(); ++i)
    made[static_cast<Eigen::Index>(i)] = is_usable(merits[i]) ? merits[i] : worst;
  return made;
}

}  // namespace surrogates
