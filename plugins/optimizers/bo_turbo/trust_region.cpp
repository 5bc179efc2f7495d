#include "trust_region.hpp"

#include <algorithm>
#include <cmath>

namespace bo_turbo {

bool is_success(double merit, double best) { return merit < best - 1e-3 * std::fabs(best); }

TrustRegion::TrustRegion(std::size_t axes) : failure_tolerance_(std::max<std::size_t>(4, axes)) {}

void TrustRegion::record(bool success) {
  successes_ = success ? successes_ + 1 : 0;
  failures_ = success ? 0 : failures_ + 1;
  if (successes_ == kSuccessTolerance) {
    length_ = std::min(2 * length_, kLargestLength);
    successes_ = 0;
  } else if (failures_ == failure_tolerance_) {
    length_ /= 2;
    failures_ = 0;
  }
}

Sides TrustRegion::sides(const Vector& centre, const Vector& length_scales) const {
  const double geometric_mean = std::exp(length_scales.array().log().mean());
  const Vector half = 0.5 * length_ / geometric_mean * length_scales;
  return {(centre - half).cwiseMax(0).cwiseMin(1), (centre + half).cwiseMax(0).cwiseMin(1)};
}

}  // namespace bo_turbo
