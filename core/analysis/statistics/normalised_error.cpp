#include "statistics/normalised_error.h"

#include <algorithm>
#include <cmath>

#include "base/displayed_rmse.h"
#include "statistics/band.h"
#include "statistics/excess.h"

namespace relign::statistics {

namespace {

// Between start and resolution; NaN if the start is within the resolution.
double decades_of(double start_excess) {
  return start_excess > kResolution ? std::log(start_excess / kResolution) : kMissing;
}

double share_of(double decades, double excess) {
  if (std::isnan(excess) || std::isnan(decades)) return kMissing;
  return std::clamp(std::log(std::max(excess, kResolution) / kResolution) / decades, 0.0, 1.0);
}

}  // namespace

double normalised_error(double excess, double start_excess) { return share_of(decades_of(start_excess), excess); }

std::vector<double> normalised_errors(const std::vector<records::StepNumbers>& steps, double own_optimum_mse,
                                      Rule rule) {
  std::vector<double> errors;
  errors.reserve(steps.size());
  if (steps.empty()) return errors;
  const double decades =
      steps.front().step == 0 ? decades_of(displayed_rmse(steps.front().commanded_mse - own_optimum_mse)) : kMissing;
  for (const double excess : excess_errors(steps, own_optimum_mse, rule)) errors.push_back(share_of(decades, excess));
  return errors;
}

double area_under(const std::vector<double>& errors, unsigned budget) {
  if (errors.empty() || budget == 0) return kMissing;
  double sum = 0;
  for (unsigned step = 1; step <= budget; ++step) sum += errors[std::min<std::size_t>(step, errors.size() - 1)];
  return sum / budget;
}

}  // namespace relign::statistics
