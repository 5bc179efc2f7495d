#include "statistics/proportion.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"
#include "statistics/distributions.h"

namespace relign::statistics {

Band success_rate(std::size_t successes, std::size_t trials, double confidence) {
  return share_of_scores(static_cast<double>(successes), trials, confidence);
}

Band share_of_scores(double total, std::size_t trials, double confidence) {
  const auto n = static_cast<double>(trials);
  if (!(total >= 0 && total <= n)) {
    throw Error(ErrorKind::internal,
                std::to_string(total) + " successes of " + std::to_string(trials) + " trials are impossible");
  }
  check_confidence(confidence);
  if (trials == 0) return {};
  const double share = total / n;
  const double z = normal_quantile((1 + confidence) / 2);
  const double scale = 1 / (1 + z * z / n);
  const double middle = (share + z * z / (2 * n)) * scale;
  const double half = z * std::sqrt(share * (1 - share) / n + z * z / (4 * n * n)) * scale;
  // The formula gives exactly 0 and 1 here, but for rounding.
  const double low = total == 0 ? 0 : std::max(0.0, middle - half);
  const double high = total == n ? 1 : std::min(1.0, middle + half);
  return {trials, share, {low, high}};
}

}  // namespace relign::statistics
